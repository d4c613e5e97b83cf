"""A sealed simulated bench as the laboratory of an investigation: it measures further, and reads what a check reads."""

import json
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from analysis.gap.experiments.catalogue import CHECKS, Experiment
from analysis.gap.experiments.expected_data import reading_of
from jointlab.diagnosis.investigation import Answer, Asked, Data, Readings, Refused
from simlab.case.bundle import write_case
from simlab.case.campaign import MEASURED, Campaign, Points, draw_setup
from simlab.case.draw import Case, random_stream

SAME = 1.01
"""Ratio up to which two amplitudes count as equal."""


@dataclass(frozen=True, eq=False)
class SealedBench:
    """The bench of a case.

    Attributes:
        case: with its truth, which no diagnosis sees.
        folder: where further bundles are written.
    """

    case: Case
    folder: Path

    def carry_out(self, asked: Asked) -> Answer:
        """Further data, readings, or a refusal of what this bench cannot do."""
        number = 1 + len(list(self.folder.glob("further_*")))
        rng = random_stream(self.case.seed, 40 + number)
        check = CHECKS.get(asked.experiment.id)
        if check is None:
            return self._measured(asked.experiment.id, number, rng)
        found = {}
        for name in asked.readings:
            reading, true = reading_of(name, check.readings), self._true(name)
            if reading is not None and true is not None:
                at = 0.0 if true == 0.0 else reading.of(true)
                found[name] = at + reading.deviation * float(rng.standard_normal())
        return Readings(found) if found else Refused("the effect has no such parameter on this bench")

    def _true(self, name: str) -> float | None:
        """A parameter of an effect, zero where it is not there; None where the bench has it under no such name."""
        wanted, _, parameter = name.partition(".")
        effect = next((each for each in self.case.effects if each.name == wanted), None)
        if effect is None:
            return 0.0
        value = effect.values.get(parameter, effect.values.get(parameter.partition("_")[0]))
        return float(value) if isinstance(value, int | float) else None

    def _measured(self, experiment: Experiment, number: int, rng: np.random.Generator) -> Answer:
        campaign, points = self.case.campaign, self.case.campaign.points
        forces = [each.peak_force for each in campaign.setups]
        force, chosen = None, None
        match experiment:
            case Experiment.HALF_FORCE:
                force = min(forces) / 2
            case Experiment.OTHER_LEVELS:
                force = 2 * max(forces)
                chosen = _at_amplitude(points, max(points.amplitude_pp_mm), 2.0)
            case Experiment.HALF_AMPLITUDE:
                chosen = _at_amplitude(points, min(points.amplitude_pp_mm), 0.5)
            case Experiment.RANDOM_ORDER:
                chosen = _only(points, rng.permutation(points.order.size))
            case Experiment.HIGHER_FREQUENCY:
                upper = points.frequency >= np.median(points.frequency)
                chosen = _only(points, np.flatnonzero(upper))
                chosen = replace(chosen, frequency=2 * chosen.frequency)
            case _:
                return Refused("this bench is simulated as it is")
        further = replace(self.case, campaign=_further(campaign, force, chosen, rng), seed=self.case.seed + number)
        path = self.folder / f"further_{number}"
        write_case(further, path)
        _leave_out(path, tester=chosen is None)
        return Data(str(path))


def _further(campaign: Campaign, force: float | None, points: Points | None, rng: np.random.Generator) -> Campaign:
    """A campaign of one further set, and of further points after the conditioning of the first."""
    known = campaign.nuisances
    temperature = campaign.setups[0].temperature
    setups = () if force is None else (draw_setup(rng, force, temperature),)
    if known is not None:
        again = known.set_up_again(rng, len(MEASURED))
        stiffness = np.concatenate([again.stiffness[: len(setups)], known.stiffness[-1:]])
        known = replace(
            known,
            stiffness=stiffness,
            leans=again.leans[: len(setups)],
            heights=again.heights[: len(setups)],
            seed=known.seed if known.common else int(rng.integers(2**31)),
        )
    later = campaign.points if points is None else points
    later = replace(later, order=np.ones(later.order.size), time=later.time + campaign.points.time[-1] + 600.0)
    return replace(campaign, setups=setups, points=later, nuisances=known, recorded=())


def _at_amplitude(points: Points, amplitude_pp_mm: float, ratio: float) -> Points:
    alike = np.abs(np.log(points.amplitude_pp_mm / amplitude_pp_mm)) < np.log(SAME)
    chosen = _only(points, np.flatnonzero(alike))
    return replace(chosen, amplitude_pp_mm=ratio * chosen.amplitude_pp_mm)


def _only(points: Points, chosen: np.ndarray) -> Points:
    """Some of the points in the order of `chosen`, each at the time of its place."""
    picked = {name: getattr(points, name)[chosen] for name in Points.__dataclass_fields__}
    return Points(**(picked | {"time": points.time[: len(chosen)]}))


def _leave_out(bundle: Path, *, tester: bool) -> None:
    """Take the tester's part out of a bundle, where nothing of it was measured again."""
    if not tester:
        return
    file = bundle / "setup.json"
    setup = json.loads(file.read_text(encoding="utf-8"))
    del setup["direct"]
    file.write_text(json.dumps(setup, indent=1) + "\n", encoding="utf-8")
    (bundle / "direct.csv").unlink()
