"""Results of several runs over each other: what of them can be compared, and their curves and intervals by run."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from analysis.direct.dynamic_stiffness import DynamicStiffness
from analysis.frequency_response import Complex, Real
from jointlab.identification.inverse import LIKELIHOOD
from jointlab.identification.read import newest_joints
from jointlab.identification.sine_points import IdentifiedSinePoint, sine_point
from jointlab.report.curves import ELEMENTS, Ends
from store.catalogue import Catalogue
from store.dof import StoredDof
from store.errors import NotFoundError
from store.measurements.frequency_responses import FrequencyResponseSet, list_frequency_responses
from store.measurements.runs import Run, get_run
from store.results.analyses import latest_analysis
from store.results.dynamic_stiffness import list_dynamic_stiffness
from store.results.joint_matrices import JointMatrix
from store.states import CONFIGURATIONS, AnalysisKind

MOST_RUNS = 12
FEWEST = 2
"""Runs that have something in common before it is shown."""
Mounting = tuple[str, str]
"""Joint and configuration."""
Row = tuple[StoredDof, StoredDof]
"""Where the hammer struck, and where the response was measured."""


@dataclass(frozen=True, eq=False)
class RunResults:
    """The newest results of one run, as far as there are any.

    Attributes:
        points: sine points of the tester.
        responses: accelerances of the first set of blows.
        joints: by maximum likelihood from the hammer, by name.
        failed: whether their fit does not pass its checks, so that nobody should rely on them.
    """

    run: Run
    points: tuple[IdentifiedSinePoint, ...]
    responses: FrequencyResponseSet | None
    joints: Mapping[str, JointMatrix]
    failed: bool

    @property
    def name(self) -> str:
        """What legends call the run."""
        return f"run {self.run.id}"


def read_results(catalogue: Catalogue, numbers: Sequence[int]) -> list[RunResults]:
    """The results of the runs with these numbers, in their order.

    Raises:
        NotFoundError: there is no such run.
    """
    return [_results(catalogue, number) for number in numbers]


def _results(catalogue: Catalogue, number: int) -> RunResults:
    with catalogue.reading() as session:
        run = get_run(session, number)
        try:
            newest = latest_analysis(session, number, AnalysisKind.DYNAMIC_STIFFNESS)
            points = tuple(map(sine_point, list_dynamic_stiffness(session, newest.id)))
        except NotFoundError:
            points = ()
        try:
            responses = list_frequency_responses(session, number)[0]
        except NotFoundError:
            responses = None
    try:
        analysis, joints = newest_joints(catalogue, run)[LIKELIHOOD]
        failed = not analysis.settings.get("passed", True)
    except (NotFoundError, KeyError):
        joints, failed = {}, False
    return RunResults(run, points, responses, joints, failed)


def common_amplitudes(results: Sequence[RunResults]) -> list[float]:
    """Amplitudes that two runs or more were asked for, mm peak to peak: those of most runs first, then the smallest."""
    count = Counter(amplitude for each in results for amplitude in {point.amplitude_pp_mm for point in each.points})
    return sorted((each for each in count if count[each] >= FEWEST), key=lambda each: (-count[each], each))


def sweeps(
    results: Sequence[RunResults], amplitude_pp_mm: float
) -> dict[Mounting, dict[str, tuple[DynamicStiffness, ...]]]:
    """By joint and configuration that two runs or more measured at an amplitude, their points by run and frequency."""
    found: dict[Mounting, dict[str, list[DynamicStiffness]]] = {}
    for each in results:
        for point in each.points:
            if point.amplitude_pp_mm == amplitude_pp_mm and point.configuration in CONFIGURATIONS:
                by_run = found.setdefault((point.specimen, point.configuration), {})
                by_run.setdefault(each.name, []).append(point.result)
    order = sorted(found, key=lambda mounting: (mounting[0], CONFIGURATIONS.index(mounting[1])))
    return {
        mounting: {run: tuple(sorted(own, key=lambda point: point.frequency)) for run, own in found[mounting].items()}
        for mounting in order
        if len(found[mounting]) >= FEWEST
    }


def common_rows(results: Sequence[RunResults]) -> list[Row]:
    """Rows of accelerances that two runs or more have: driving points first, then those of most runs."""
    sets = [each.responses for each in results if each.responses is not None]
    count = Counter((point, each.response) for each in sets for point in each.inputs)
    return sorted(
        (row for row in count if count[row] >= FEWEST),
        key=lambda row: (row[0] != row[1], -count[row], row[0].direction != "y", row[0].node),
    )


def accelerances(results: Sequence[RunResults], row: Row) -> dict[str, tuple[Real, Complex]]:
    """By run that has it, frequency (lines,) in Hz and accelerance (lines,) of a row in (m/s^2)/N."""
    struck, response = row
    return {
        each.name: (each.responses.frequency, each.responses.accelerance[each.responses.inputs.index(struck)])
        for each in results
        if each.responses is not None and each.responses.response == response and struck in each.responses.inputs
    }


def joint_intervals(results: Sequence[RunResults]) -> dict[str, dict[str, Ends]]:
    """By term and joint that two runs or more determine, such as "k22 I", 95 % intervals by run; k in N/m.

    Joints of a fit that fails its checks are left out.
    """
    found: dict[str, dict[str, Ends]] = {}
    results = [each for each in results if not each.failed]
    names = dict.fromkeys(name for each in results for name in each.joints)
    for element, at in ELEMENTS:
        for quantity in (element, f"gamma{element[1:]}"):
            for name in names:
                own = {each.name: _interval(each.joints[name], quantity, at) for each in results if name in each.joints}
                known = {run: ends for run, ends in own.items() if ends is not None}
                if len(known) >= FEWEST:
                    found[f"{quantity} {name}"] = known
    return found


def _interval(joint: JointMatrix, quantity: str, at: tuple[int, int]) -> Ends | None:
    """Both ends; None where the term is not observable, or they are not known."""
    ends = (joint.stiffness_ci95 if quantity.startswith("k") else joint.loss_factor_ci95)[at]
    return (float(ends[0]), float(ends[1])) if joint.observable[at] and np.isfinite(ends).all() else None
