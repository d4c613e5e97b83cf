"""What standards ask a report to say, item by item in our own words, beside what the report has; `docs/standards.md`.

An item whose fact is None has no place in the store.
"""

from collections.abc import Mapping

from jointlab.report.section import Cell, Section, Table, Unknown

Requirements = tuple[tuple[str, str | None], ...]
"""What is asked for, and the name of the fact that answers it."""

NOT_RECORDED = "not recorded"
ISO_10846: Requirements = (
    ("laboratory", "laboratory"),
    ("date", "dates"),
    ("who made the test", "operator"),
    ("specimen: what it is and how it is built", "specimens"),
    ("specimen: maker, type, age, serial number", "description"),
    ("mounting between the flanges", "configurations"),
    ("static preload, as a force", None),
    ("static preload, as a displacement", "preset"),
    ("temperature", "temperature"),
    ("relative humidity", None),
    ("rest and conditioning before the test", "conditioning"),
    ("instruments", "instruments"),
    ("their calibration", "calibration"),
    ("signal and its frequencies", "sines"),
    ("level of the excitation", "amplitudes"),
    ("test for linearity", "linearity"),
    ("adequacy of the rig: its own compliance and inertia", "rig"),
    ("flanking transmission and unwanted directions", None),
    ("dynamic stiffness and loss factor over frequency, with uncertainty", "stiffness"),
    ("levels in one-third-octave bands", None),
)
ISO_6721: Requirements = (
    ("date", "dates"),
    ("material: kind, source, maker's code, history", "description"),
    ("shape of specimens", "specimens"),
    ("dimensions of specimens", None),
    ("how specimens were made", None),
    ("conditioning", "conditioning"),
    ("atmosphere, where it is not air", None),
    ("apparatus", "instruments"),
    ("mode of deformation", "configurations"),
    ("temperatures", "temperature"),
    ("frequencies", "sines"),
    ("amplitude, as a displacement", "amplitudes"),
    ("amplitude, as a strain", None),
    ("wave form", "waveform"),
    ("moduli: the stiffness of a joint is no modulus", None),
    ("loss factor, with uncertainty", "stiffness"),
)
ISO_7626: Requirements = (
    ("laboratory", "laboratory"),
    ("date", "dates"),
    ("who made the test", "operator"),
    ("structure under test", "beam"),
    ("its support", "specimens"),
    ("place and kind of the excitation", "excitation"),
    ("tip of the hammer", None),
    ("place and mass of the motion transducer", "response"),
    ("how the transducer is attached", None),
    ("instruments", "instruments"),
    ("calibration of the transducers", "calibration"),
    ("examination of the whole chain before the test", "examination"),
    ("sample rate, length of records, frequency resolution", "digitising"),
    ("averages, estimator, windows", "averages"),
    ("blows that are refused", "refused"),
    ("coherence", "coherence"),
    ("temperature", "temperature"),
    ("frequency response as magnitude and phase", "accelerances"),
)
BY_EXPERIMENT = {
    "stiffness": (
        ("ISO 10846-1 and -2, resilient elements, direct method", ISO_10846),
        ("ISO 6721-1, dynamic mechanical properties of plastics, as far as a joint can follow it", ISO_6721),
    ),
    "accelerances": (("ISO 7626-1 and -5, mechanical mobility by impact", ISO_7626),),
}
"""Lists by the fact that only the experiment they are for has."""


def standards_section(facts: Mapping[str, str]) -> Section:
    """The lists for the experiments that were made."""
    return Section(
        "What standards ask to be reported",
        (
            "In our own words; the wording in force is that of the edition that you hold. A list claims no conformity.",
            *(
                Table(title, ("", "asked for", "here"), tuple(_row(item, name, facts) for item, name in asked))
                for experiment, lists in BY_EXPERIMENT.items()
                if experiment in facts
                for title, asked in lists
            ),
        ),
    )


def _row(item: str, name: str | None, facts: Mapping[str, str]) -> tuple[Cell, ...]:
    if name is None or name not in facts:
        why = "the store has no place for it" if name is None else ""
        return "–", item, Unknown(NOT_RECORDED, why)
    return "✓", item, facts[name]
