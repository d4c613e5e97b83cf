"""Dynamic stiffness at any amplitude and frequency, by the laws that were fitted to sine points.

The value of one cylinder comes from its own law. The interval for another cylinder of its kind comes from the spread of
the specimens at that point.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache

from analysis.direct.cylinder_terms import CylinderTerms, JointTerms
from analysis.direct.dynamic_stiffness import DynamicStiffness
from analysis.direct.law_fit import FEWEST_POINTS
from analysis.direct.specimen_scatter import FEWEST_SPECIMENS, SpecimenScatter, scatter_of_laws
from jointlab.errors import JointlabError
from jointlab.identification.direct import Direct, direct_of
from jointlab.identification.direct_notices import direct_notices
from jointlab.identification.measurement import MeasuredArticle
from jointlab.identification.read import article_of
from jointlab.identification.sine_points import sine_point
from store.catalogue import Catalogue
from store.errors import NotFoundError
from store.measurements.amendments import setup_of_version
from store.measurements.runs import get_run
from store.results.analyses import latest_analysis
from store.results.dynamic_stiffness import list_dynamic_stiffness
from store.states import CONFIGURATIONS, AnalysisKind


@dataclass(frozen=True, eq=False)
class SpecimenAt:
    """One specimen at the amplitude and frequency in question.

    Attributes:
        specimen: the joint whose cylinders were tested.
        notices: what speaks against its points, one sentence each.
        contradicted: whether its configurations contradict each other, so that no interval can be relied on.
        cylinder: a and b of one of them.
        joint: the terms of the joint that two of them make.
        beyond: in which way the question is outside of what was measured, one phrase each; empty inside.
    """

    specimen: str
    cylinder: CylinderTerms
    joint: JointTerms
    beyond: tuple[str, ...]
    notices: tuple[str, ...]
    contradicted: bool

    @property
    def terms(self) -> dict[str, DynamicStiffness]:
        """a and b of the cylinder, k11, k22 and k12 of the joint, by name."""
        of_cylinder = {"a": self.cylinder.shear, "b": self.cylinder.compression}
        return of_cylinder | {"k11": self.joint.k11, "k22": self.joint.k22, "k12": self.joint.k12}


@dataclass(frozen=True, eq=False)
class StiffnessAt:
    """All specimens at `amplitude_pp` m peak to peak and `frequency` Hz.

    Attributes:
        scatter: of a and b over the specimens, taken to be of one kind; None for one specimen.
    """

    amplitude_pp: float
    frequency: float
    specimens: tuple[SpecimenAt, ...]
    scatter: SpecimenScatter | None


def laws_of(measurement: MeasuredArticle) -> dict[str, Direct]:
    """The tester's results for each joint that has a law, fitted to the measurement's sine points.

    Raises:
        JointlabError: no joint has points enough.
        AnalysisError: points of different configurations do not belong together.
    """
    direct = direct_of(measurement)
    with_law = {name: found for name, found in direct.items() if found.law is not None}
    if not with_law:
        counts = {name: sum(map(len, found.cylinders.values())) for name, found in direct.items()}
        refused = [f"joint {name}, {text}" for name, found in direct.items() for text in found.left_out]
        had = ", ".join(f"joint {name} {count}" for name, count in counts.items()) or "there are no sine points"
        raise JointlabError(
            f"{measurement.title}: too few points for a law of stiffness; it needs {FEWEST_POINTS} points of positive "
            f"stiffness, measured in {', '.join(CONFIGURATIONS)}: {'; '.join([had, *refused[:1]])}"
        )
    return with_law


def points_of_run(catalogue: Catalogue, run_id: int) -> int:
    """Number of the newest analysis that computed the sine points of a run.

    Raises:
        NotFoundError: there is no such run, or it was not identified.
    """
    with catalogue.reading() as session:
        get_run(session, run_id)
        try:
            return latest_analysis(session, run_id, AnalysisKind.DYNAMIC_STIFFNESS).id
        except NotFoundError as error:
            raise NotFoundError(f"{error}; identify it first: jointlab identify {run_id}") from error


def laws_of_points(catalogue: Catalogue, run_id: int, analysis_id: int) -> Mapping[str, Direct]:
    """The laws through the stored points of an analysis, on the article as it was amended last.

    They are kept for the next caller until the setup is amended.

    Raises:
        NotFoundError: there is no such run, it has no article, or the analysis has no points.
        JointlabError, AnalysisError: what `laws_of` raises.
    """
    return _laws_of_version(catalogue, run_id, analysis_id, catalogue.read(get_run, run_id).setup_version)


@lru_cache(maxsize=8)
def _laws_of_version(catalogue: Catalogue, run_id: int, analysis_id: int, version: int) -> Mapping[str, Direct]:
    with catalogue.reading() as session:
        run = replace(get_run(session, run_id), setup=setup_of_version(session, run_id, version))
        stored = list_dynamic_stiffness(session, analysis_id)
    points = tuple(map(sine_point, stored))
    return laws_of(MeasuredArticle(run.title, article_of(run), (), points, raw=False))


def stiffness_at(
    direct: Mapping[str, Direct], amplitude_pp: float, frequency: float, only: Collection[str] = ()
) -> StiffnessAt:
    """Ask the laws.

    Args:
        direct: of each joint by its name, as `laws_of` gives it.
        amplitude_pp: of the cylinder's motion, m peak to peak.
        frequency: Hz.
        only: of these joints; all where empty.

    Raises:
        JointlabError: a joint is not there.
        AnalysisError: amplitude or frequency is not positive.
    """
    laws = {name: found.law for name, found in direct.items() if found.law is not None}
    if missing := set(only) - set(laws):
        raise JointlabError(f"no law for joint {', '.join(sorted(missing))}; there are {', '.join(laws)}")
    asked = {name: law for name, law in laws.items() if not only or name in only}
    return StiffnessAt(
        amplitude_pp=amplitude_pp,
        frequency=frequency,
        specimens=tuple(
            SpecimenAt(
                name,
                law.cylinder.at(amplitude_pp, frequency),
                law.at(amplitude_pp, frequency),
                law.beyond(amplitude_pp, frequency),
                direct_notices(name, direct[name]),
                direct[name].contradicted,
            )
            for name, law in asked.items()
        ),
        scatter=(
            scatter_of_laws({name: law.cylinder for name, law in asked.items()}, amplitude_pp, frequency)
            if len(asked) >= FEWEST_SPECIMENS
            else None
        ),
    )
