"""The report's sections on the hammer experiment: Tables 2 to 4 and Figs. 5 to 9."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from analysis.beam import Mesh
from analysis.dof import Direction, Dof
from analysis.forward import eigensolution
from analysis.mode_agreement import ModeError
from analysis.modes import Modes
from analysis.tables import FrequencyRow, TermRow, loss_factor_terms, stiffness_terms, supported_frequencies
from api.identification.pipeline import Inverse
from api.report import figures
from api.report.section import Picture, Section, Table, ends, number

SHOWN_DIRECTIONS = 3
TOLERATED_MISFIT = 1.1  # chi-square per degree of freedom
# Figs. 7, 8 and 9: driving point, transverse cross point, longitudinal blow.
FIGURED_POINTS = (("Fig. 7", "3y"), ("Fig. 8", "1y"), ("Fig. 9", "1x"))


def inverse_sections(inverse: Inverse) -> list[Section]:
    """Modes, joints and forward prediction."""
    return [_modes(inverse), _joints(inverse), _prediction(inverse)]


def _modes(inverse: Inverse) -> Section:
    modal = inverse.modal
    pairs = {pair.measured: pair for pair in inverse.errors}
    highest = 1.2 * float(np.max(modal.modes.frequency))
    joints = [found.joint for found in inverse.joints.values()]
    theory = supported_frequencies(inverse.free_beam.beam, inverse.free_beam.mesh, joints, highest)
    rows = tuple(
        (
            str(mode + 1),
            ends(modal.frequency_ci95[mode], 6),
            *_predicted_frequencies(pairs.get(mode), theory),
            ends(modal.loss_factor_ci95[mode]),
            *((number(pairs[mode].predicted_loss_factor), f"{pairs[mode].mac:.4f}") if mode in pairs else ("–", "–")),
        )
        for mode in range(modal.modes.poles.size)
    )
    head = (
        "mode",
        "measured, 95 % (Hz)",
        "Timoshenko (Hz)",
        "Euler-Bernoulli (Hz)",
        "Timoshenko off by (%)",
        "loss factor, 95 %",
        "predicted",
        "MAC",
    )
    return Section(
        "Modes of the supported beam",
        (
            "Predicted modes are those of the beam on the joints that the paper's method identifies from these "
            "measured modes. That method leaves k12 several per cent off even on exact modes, and the two lowest "
            "modes, near-repeated, show it most.",
            *_misfit(inverse),
            Table("Table 4: natural frequencies, measured and predicted", head, rows),
            Picture("Fig. 6: mode shapes", _shapes(inverse)),
        ),
    )


def _predicted_frequencies(pair: ModeError | None, theory: Sequence[FrequencyRow]) -> tuple[str, str, str]:
    """Timoshenko, Euler-Bernoulli, and how far off the former is; dashes for a mode that nothing predicts."""
    if pair is None:
        return "–", "–", "–"
    other = theory[pair.predicted].euler_bernoulli if pair.predicted < len(theory) else None
    return (
        number(pair.predicted_frequency, 5),
        "–" if other is None else number(other, 5),
        f"{100 * pair.frequency_error:+.2f}",
    )


def _misfit(inverse: Inverse) -> list[str]:
    """A warning where the modes do not explain the accelerances to within their noise."""
    scale = inverse.modal.noise_scale
    if scale <= TOLERATED_MISFIT:
        return []
    return [
        f"These modes leave more than noise: chi-square is {number(scale)} per degree of freedom. Intervals are "
        "widened by its root, but something in the measurement is not a linear structure with these modes."
    ]


def _shapes(inverse: Inverse) -> str:
    """Fig. 6, the prediction at every node of the mesh."""
    mesh = inverse.free_beam.mesh
    every = Mesh(mesh.positions, tuple(range(mesh.positions.size)))
    beam = replace(inverse.free_beam, mesh=every)
    joints = [replace(found.joint, node=mesh.named[found.node - 1] + 1) for found in inverse.joints.values()]
    nodes = [Dof(node, Direction.Y) for node in range(1, mesh.positions.size + 1)]
    predicted = eigensolution(beam, joints, 1.2 * float(np.max(inverse.modal.modes.frequency)), nodes)
    pairs = sorted(inverse.errors, key=lambda pair: pair.measured)
    measured, theirs = inverse.modal.modes, [pair.measured for pair in pairs]
    order = [pair.predicted for pair in pairs]
    return figures.mode_shapes(
        Modes(measured.poles[theirs], measured.shapes[theirs], measured.dofs),
        Modes(predicted.poles[order], predicted.shapes[order], predicted.dofs),
        {dof: float(mesh.positions[mesh.named[dof.node - 1]]) for dof in measured.dofs},
        {dof: float(mesh.positions[dof.node - 1]) for dof in nodes},
    )


def _joints(inverse: Inverse) -> Section:
    estimates = list(inverse.joints.values())
    unit = inverse.free_beam.beam.stiffness_unit
    head = ("element", *(f"joint {name}" for name in inverse.joints))
    regressions = {name: (found.regression.observed, found.regression.fitted) for name, found in inverse.joints.items()}
    return Section(
        "Joints by the paper's method",
        (
            "Stiffness is divided by EI/L³ (translation), EI/L² (coupling) and EI/L (rotation). Terms in brackets are "
            "not observable: these data alone do not determine them.",
            Table("Table 2: stiffness", head, _term_rows(stiffness_terms(estimates, unit))),
            Table("Table 3: loss factor", head, _term_rows(loss_factor_terms(estimates))),
            *_weak(inverse),
            Picture(
                "Fig. 5: joint equations, observed against curve-fitted",
                figures.regression(regressions),
            ),
        ),
    )


def _weak(inverse: Inverse) -> list[str]:
    """What the modes leave open, a sentence each, the worst first."""
    weak = inverse.weak_directions
    if weak is None:
        return [
            "The identified joints do not give back as many modes as were measured, so nothing can be said of what "
            "these modes determine."
        ]
    if not weak:
        return ["These modes determine every term."]
    shown = [f"Hardly determined: {each.text}." for each in weak[:SHOWN_DIRECTIONS]]
    more = len(weak) - len(shown)
    return shown + ([f"So are {more} more combinations; the JSON document names them."] if more else [])


def _term_rows(terms: tuple[TermRow, ...]) -> tuple[tuple[str, ...], ...]:
    """A row for each element of the upper triangle, a column for each joint."""
    elements = [term.element for term in terms if term.element[-2] <= term.element[-1]]
    wanted = dict.fromkeys(elements)

    def cell(term: TermRow) -> str:
        text = f"{number(term.value)} [{ends((term.low, term.high))}]"
        if term.value != term.value:
            return "–"
        return text if term.observable else f"({text})"

    return tuple((element, *(cell(term) for term in terms if term.element == element)) for element in wanted)


def _prediction(inverse: Inverse) -> Section:
    predicted = inverse.predicted_responses
    pictures = tuple(
        Picture(
            f"{label}: accelerance at {inverse.measured.response} for a blow at {point}",
            figures.accelerance(label, inverse.measured, predicted, Dof.parse(point)),
        )
        for label, point in FIGURED_POINTS
        if Dof.parse(point) in inverse.measured.inputs
    )
    return Section("Accelerances, measured and predicted", pictures)
