import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from analysis import comparison
from analysis.comparison import Agreement, Bounds, ElementComparison
from analysis.direct.cylinder_terms import (
    JointLaw,
    JointTerms,
    cylinder_terms,
    fit_cylinder_law,
    joint_terms,
    match_configurations,
)
from analysis.direct.dynamic_stiffness import DynamicStiffness
from analysis.direct.pair_lean import lean_of
from analysis.errors import AnalysisError
from analysis.frequency_response import Real
from analysis.inverse.joint_estimate import IdentifiedJoint
from analysis.inverse.undetermined_terms import Unobservable, reasons_array
from analysis.joint_amplitude import JointAmplitude
from tests.analysis.direct.points import point

A, B = 0.36e6 * (1 + 0.10j), 2.30e6 * (1 + 0.12j)
LEANING = {"I": -math.pi / 4, "II": math.pi / 4}
SIGN = {"I": 1.0, "II": -1.0}


def sweep(joint: str, error: float = 0.01, highest: float = 200.0) -> list[JointTerms]:
    """A sweep at two amplitudes; the larger one is half as stiff."""
    found = []
    for amplitude_pp, softness in ((1e-5, 1.0), (1e-4, 0.5)):
        for frequency in np.arange(5.0, highest + 1, 5.0):
            terms = cylinder_terms(
                [point(softness * B, error, frequency, amplitude_pp)],
                [point(softness * 2 * A, error, frequency, amplitude_pp)],
                [point(softness * (A + B), error, frequency, amplitude_pp)],
            )
            found.append(joint_terms(terms[0], LEANING[joint]))
    return found


@dataclass(frozen=True)
class Identified:
    """Stands for what the inverse test hands over."""

    stiffness: Real
    loss_factor: Real
    error: float = 0.02
    observable: NDArray[np.bool_] = field(default_factory=lambda: np.ones((3, 3), dtype=bool))

    @property
    def joint(self) -> IdentifiedJoint:
        half_of_k, half_of_gamma = 1.96 * self.error * np.abs(self.stiffness), 1.96 * self.error
        return IdentifiedJoint(
            name="I",
            node=1,
            stiffness=self.stiffness,
            damping=self.stiffness * self.loss_factor,
            covariance=np.zeros((12, 12)),
            k_ci95=np.stack([self.stiffness - half_of_k, self.stiffness + half_of_k], axis=-1),
            h_ci95=np.zeros((3, 3, 2)),
            loss_factor=self.loss_factor,
            loss_factor_ci95=np.stack([self.loss_factor - half_of_gamma, self.loss_factor + half_of_gamma], axis=-1),
            why_not=reasons_array(
                [None if known else Unobservable.INCLUDES_ZERO for known in self.observable.ravel()]
            ).reshape(3, 3),
        )


def compare(
    direct: Mapping[str, Sequence[JointTerms] | JointLaw], inverse: Mapping[str, Identified], **options: Any
) -> tuple[ElementComparison, ...]:
    return comparison.compare(direct, {name: each.joint for name, each in inverse.items()}, **options)


def identified(joint: str, scale: float = 1.0) -> Identified:
    coupling = SIGN[joint] * (B - A)
    full = np.array([[A + B, coupling, 0], [coupling, A + B, 0], [0, 0, 400.0]])
    with np.errstate(invalid="ignore"):
        return Identified(scale * full.real, full.imag / full.real)


def both(scale: float = 1.0) -> tuple[dict[str, list[JointTerms]], dict[str, Identified]]:
    return {name: sweep(name) for name in LEANING}, {name: identified(name, scale) for name in LEANING}


def pick(result: tuple[ElementComparison, ...], joint: str, element: str) -> ElementComparison:
    (found,) = [each for each in result if (each.joint, each.element) == (joint, element)]
    return found


def test_equal_joints_agree_in_every_element_and_sign() -> None:
    result = compare(*both())
    assert len(result) == 12
    assert {each.verdict for each in result} == {Agreement.AGREE}
    assert pick(result, "I", "k12").direct.value == pytest.approx((B - A).real)
    assert pick(result, "II", "k12").direct.value == pytest.approx((A - B).real)


def test_a_joint_ten_percent_stiffer_differs_in_stiffness_and_not_in_loss_factor() -> None:
    result = compare(*both(scale=1.1))
    assert pick(result, "I", "k22").verdict is Agreement.DIFFER
    assert pick(result, "I", "k22").reason.startswith("inverse less direct is 10.0 +- ")
    assert pick(result, "I", "gamma22").verdict is Agreement.AGREE


def test_the_wrong_sign_of_coupling_is_seen() -> None:
    direct, inverse = both()
    inverse["I"] = replace(inverse["I"], stiffness=inverse["I"].stiffness * [[1, -1, 1], [-1, 1, 1], [1, 1, 1]])
    assert pick(compare(direct, inverse), "I", "k12").verdict is Agreement.DIFFER


def test_the_smallest_amplitude_is_taken_unless_told() -> None:
    direct, inverse = both(scale=0.5)
    assert pick(compare(direct, inverse), "I", "k22").verdict is Agreement.DIFFER
    told = pick(compare(direct, inverse, amplitude_pp=0.9e-4), "I", "k22")
    assert told.verdict is Agreement.AGREE
    assert told.amplitude_pp == pytest.approx(1e-4)


def test_modes_within_the_testers_band_are_where_it_is_read() -> None:
    direct, inverse = both()
    found = pick(compare(direct, inverse, mode_frequencies=(77.4, 79.5, 204.0, 469.0)), "I", "k22")
    assert found.basis == "at the modes 77.4, 79.5 Hz"


def test_without_a_mode_in_the_band_the_flat_part_of_it_is_averaged() -> None:
    direct, inverse = both()
    found = pick(compare(direct, inverse, mode_frequencies=(266.0, 469.0)), "I", "k22")
    assert found.basis == "mean of 31 points over 50-200 Hz"


def test_between_two_points_the_direct_value_is_interpolated() -> None:
    rising = [
        replace_stiffness(terms, complex(terms.frequency * 1e4, terms.frequency * 1e3)) for terms in sweep("I")[:40]
    ]
    found = pick(compare({"I": rising}, {"I": identified("I")}, mode_frequencies=(77.0,)), "I", "k22")
    assert found.direct.value == pytest.approx(77e4)


def replace_stiffness(terms: JointTerms, value: complex, covariance: Real | None = None) -> JointTerms:
    def replaced(term: DynamicStiffness) -> DynamicStiffness:
        return replace(term, complex_stiffness=value, covariance=term.covariance if covariance is None else covariance)

    return JointTerms(replaced(terms.k11), replaced(terms.k22), replaced(terms.k12))


def test_a_direct_value_that_varies_over_the_band_has_a_wider_interval() -> None:
    flat = sweep("I")[:40]
    rising = [replace_stiffness(terms, (A + B) * (1 + terms.frequency / 1000)) for terms in flat]
    steady = [replace_stiffness(terms, A + B) for terms in flat]
    inverse = {"I": identified("I")}
    wide, narrow = (pick(compare({"I": points}, inverse), "I", "k22").direct for points in (rising, steady))
    assert wide.high - wide.low > 3 * (narrow.high - narrow.low)


def test_where_single_terms_are_not_observable_their_sum_is_compared() -> None:
    direct, inverse = both()
    hidden = np.ones((3, 3), dtype=bool)
    hidden[0, 0] = False
    inverse = {name: replace(joint, observable=hidden) for name, joint in inverse.items()}
    result = compare(direct, inverse)
    alone = pick(result, "I", "k11")
    assert alone.verdict is Agreement.NOT_COMPARABLE
    assert alone.reason == "the inverse test alone does not determine k11 of this joint"
    together = pick(result, "I+II", "k11")
    assert together.verdict is Agreement.AGREE
    assert together.direct.value == pytest.approx(2 * (A + B).real)
    assert together.inverse is not None
    # half-widths are added, not their squares
    assert together.inverse.high - together.inverse.value == pytest.approx(0.0392 * together.inverse.value)
    assert pick(result, "I+II", "gamma11").direct.value == pytest.approx((A + B).imag / (A + B).real)
    assert pick(result, "I+II", "gamma11").verdict is Agreement.AGREE


def test_a_sum_with_known_correlation_replaces_the_cautious_one() -> None:
    direct, inverse = both(scale=1.03)
    hidden = np.ones((3, 3), dtype=bool)
    hidden[0, 0] = False
    inverse = {name: replace(joint, observable=hidden) for name, joint in inverse.items()}
    k11 = 1.03 * 2 * (A + B).real
    sums = {"k11": Bounds(k11, 0.999 * k11, 1.001 * k11)}
    assert pick(compare(direct, inverse), "I+II", "k11").verdict is Agreement.AGREE
    assert pick(compare(direct, inverse, sums=sums), "I+II", "k11").verdict is Agreement.DIFFER


def test_an_interval_that_would_admit_zero_is_not_called_agreement() -> None:
    direct, inverse = both()
    inverse["I"] = replace(inverse["I"], error=0.9)
    found = pick(compare(direct, inverse), "I", "k22")
    assert found.verdict is Agreement.NOT_COMPARABLE
    assert "zero for the element would agree too" in found.reason


@pytest.mark.parametrize("factor", [1e-3, 1e3])
def test_a_direct_table_in_another_unit_differs_in_every_stiffness(factor: float) -> None:
    direct = {
        name: [
            replace_stiffness(terms, factor * terms.k11.complex_stiffness, factor**2 * terms.k11.covariance)
            for terms in sweep(name)
        ]
        for name in LEANING
    }
    inverse = {name: identified(name) for name in LEANING}
    for name in LEANING:
        found = pick(compare(direct, inverse), name, "k22")
        assert found.verdict is Agreement.DIFFER
        assert found.reason.endswith("zero lies outside")


def test_a_joint_far_from_a_direct_value_that_may_be_zero_differs_and_its_loss_factor_is_not_compared() -> None:
    no_coupling = [
        replace(terms, k12=replace(terms.k12, complex_stiffness=1e3 + 1e3j, covariance=1e8 * np.eye(2)))
        for terms in sweep("I")
    ]
    result = compare({"I": no_coupling}, {"I": identified("I")})
    assert pick(result, "I", "k12").verdict is Agreement.DIFFER
    loss_factor = pick(result, "I", "gamma12")
    assert loss_factor.verdict is Agreement.NOT_COMPARABLE
    assert loss_factor.reason == "the direct k12 may be zero, which leaves no loss factor"


def test_a_shared_ratio_of_a_thousand_is_the_factor_of_a_unit() -> None:
    ratios = {"I": (980.0, -1100.0), "II": (0.0011,), "III": (1.1, 0.9), "IV": (100.0, 700.0), "V": ()}
    assert comparison.unit_factors(ratios) == {"I": 1e3, "II": 1e-3}


def test_a_loss_factor_without_meaning_is_not_compared() -> None:
    direct, inverse = both()
    lost = inverse["I"].loss_factor.copy()
    lost[0, 1] = np.nan
    inverse["I"] = replace(inverse["I"], loss_factor=lost)
    found = pick(compare(direct, inverse), "I", "gamma12")
    assert found.verdict is Agreement.NOT_COMPARABLE
    assert found.inverse is None


def test_a_common_uncertainty_widens_stiffness_and_leaves_loss_factor() -> None:
    direct, inverse = both(scale=1.1)
    assert pick(compare(direct, inverse, relative_uncertainty=0.1), "I", "k22").verdict is Agreement.AGREE
    plain, widened = (compare(direct, inverse, relative_uncertainty=u) for u in (0.0, 0.1))
    assert pick(plain, "I", "gamma22").direct == pick(widened, "I", "gamma22").direct


@given(scale=st.floats(1e-6, 1e6), excess=st.floats(0.8, 1.2))
def test_the_unit_of_force_changes_no_verdict(scale: float, excess: float) -> None:
    few = sweep("I", highest=60.0)
    scaled = [
        JointTerms(
            *(
                replace(term, complex_stiffness=scale * term.complex_stiffness, covariance=scale**2 * term.covariance)
                for term in (terms.k11, terms.k22, terms.k12)
            )
        )
        for terms in few
    ]
    plain = compare({"I": few}, {"I": identified("I", excess)})
    other = compare({"I": scaled}, {"I": identified("I", scale * excess)})
    assert [each.verdict for each in plain] == [each.verdict for each in other]


def test_true_joints_agree_in_ninety_five_of_a_hundred_repeats() -> None:
    rng = np.random.default_rng(5)
    points, joint, runs = sweep("I", error=0.02)[9:10], identified("I"), 1000
    known_to = points[0].k22.stiffness_estimate.standard_error
    agreed = 0
    for _ in range(runs):
        shifted = [replace_stiffness(terms, A + B + known_to * rng.standard_normal()) for terms in points]
        moved = replace(joint, stiffness=joint.stiffness * (1 + joint.error * rng.standard_normal()))
        agreed += pick(compare({"I": shifted}, {"I": moved}), "I", "k22").verdict is Agreement.AGREE
    assert agreed / runs == pytest.approx(0.95, abs=0.021)  # 1000 repeats know it to 0.7 %


def leaning(theta: float, delta: float, gain: float = 1.0, tolerance: float = 0.0) -> JointTerms:
    """A joint at 50 Hz, drawn at theta, whose frame leans by delta in the tester as well, hardly any noise."""
    more = math.sin(2 * delta)
    compression, shear, angled = (
        point(gain * value, 1e-4, 50.0, 1e-5) for value in (B, 2 * A, (1 - more) * A + (1 + more) * B)
    )
    lean = lean_of([match_configurations([compression], [shear], [angled])], tolerance)
    return joint_terms(cylinder_terms([compression], [shear], [angled], lean=lean)[0], theta, lean)


@pytest.mark.parametrize(("element", "joint"), [("k22", "I"), ("k11", "I+II")])
def test_joints_that_lean_within_their_tolerance_agree_in_ninety_five_of_a_hundred_benches(
    element: str, joint: str
) -> None:
    """The tester's gain is one for both joints, the lean of each is its own, in the tester as under the beam."""
    rng, gain, inclination, runs = np.random.default_rng(6), 0.01, math.radians(0.5), 400
    agreed = 0
    for _ in range(runs):
        by, direct, inverse = 1 + gain * rng.standard_normal(), {}, {}
        for name, theta in LEANING.items():
            delta = inclination * rng.standard_normal()
            direct[name] = [leaning(theta, delta, by, inclination)]
            true = joint_terms(cylinder_terms(*steady())[0], theta - math.copysign(1.0, theta) * delta)
            stands = identified(name)
            for (p, q), term in (((0, 0), true.k11), ((0, 1), true.k12), ((1, 0), true.k12), ((1, 1), true.k22)):
                stands.stiffness[p, q] = term.stiffness
            hidden = np.ones((3, 3), dtype=bool)
            hidden[0, 0] = False
            inverse[name] = replace(stands, error=1e-4, observable=hidden)
        found = compare(direct, inverse, relative_uncertainty=gain)
        agreed += pick(found, joint, element).verdict is Agreement.AGREE
    assert agreed / runs == pytest.approx(0.95, abs=0.033)  # 400 repeats know it to 1.1 %


@pytest.mark.parametrize(("element", "joint"), [("k22", "I"), ("k11", "I+II"), ("gamma22", "II")])
def test_joints_that_scatter_between_set_ups_as_stated_agree_in_ninety_five_of_a_hundred_benches(
    element: str, joint: str
) -> None:
    rng, scatter, runs = np.random.default_rng(8), 0.02, 400
    agreed = 0
    for _ in range(runs):
        direct, inverse = {}, {}
        for name, theta in LEANING.items():
            in_tester, under_beam = 1 + scatter * rng.standard_normal(2)
            direct[name] = [leaning(theta, 0.0, in_tester)]
            true, stands = joint_terms(cylinder_terms(*steady())[0], theta), identified(name)
            for (p, q), term in (((0, 0), true.k11), ((0, 1), true.k12), ((1, 0), true.k12), ((1, 1), true.k22)):
                stands.stiffness[p, q] = under_beam * term.stiffness
            hidden = np.ones((3, 3), dtype=bool)
            hidden[0, 0] = False
            inverse[name] = replace(stands, error=1e-4, observable=hidden)
        found = compare(direct, inverse, setup_scatter=scatter)
        agreed += pick(found, joint, element).verdict is Agreement.AGREE
    expected = 0.95 if element.startswith("k") else 1.0  # both parts of a stiffness scatter alike
    assert agreed / runs == pytest.approx(expected, abs=0.033)  # 400 repeats know it to 1.1 %


def steady() -> tuple[list[DynamicStiffness], ...]:
    """Compression, shear and angled of an upright frame."""
    return tuple([point(value, 1e-4, 50.0, 1e-5)] for value in (B, 2 * A, A + B))


def test_what_cannot_be_compared_is_refused_with_the_reason() -> None:
    direct, inverse = both()
    with pytest.raises(AnalysisError, match="same ones"):
        compare({"I": direct["I"]}, inverse)
    with pytest.raises(AnalysisError, match="no point"):
        compare({"I": [], "II": direct["II"]}, inverse)
    with pytest.raises(AnalysisError, match="between 5 and 30 Hz"):
        compare({"I": sweep("I", highest=30.0)}, {"I": inverse["I"]})
    with pytest.raises(AnalysisError, match="amplitude"):
        compare(direct, inverse, amplitude_pp=-1.0)


@pytest.fixture(scope="module")
def law() -> JointLaw:
    """Stiffness falls by 15 % for each doubling of amplitude, at every frequency."""
    points = [
        [
            point(softness * share, 0.002, frequency, amplitude_pp)
            for amplitude_pp, softness in ((1e-5, 1.0), (2e-5, 0.85), (5e-5, 0.69), (1e-4, 0.58))
            for frequency in (10.0, 30.0, 80.0, 200.0)
        ]
        for share in (B, 2 * A, A + B)
    ]
    return JointLaw(fit_cylinder_law(cylinder_terms(*points)), LEANING["I"])


def test_a_law_is_asked_at_each_mode_and_at_the_amplitude_of_the_blows(law: JointLaw) -> None:
    amplitudes = {"I": JointAmplitude(np.array([1e-5, 2e-5, 1.5e-5]))}
    result = compare(
        {"I": law}, {"I": identified("I", 0.92)}, mode_frequencies=(79.0, 204.0, 469.0), amplitude_pp=amplitudes
    )
    found = pick(result, "I", "k22")
    assert found.direct.value == pytest.approx((1 + 0.85) / 2 * (A + B).real, rel=0.02)
    assert found.basis == (
        "by the fitted law at the modes 79.0, 204.0 Hz and 0.01, 0.02 mm; 204 Hz is above the measured 200 Hz"
    )
    assert found.amplitude_pp == pytest.approx(1.5e-5)
    assert found.verdict is Agreement.AGREE


def test_the_amplitude_decides_whether_a_softening_joint_agrees(law: JointLaw) -> None:
    def verdict(amplitude_pp: float) -> Agreement:
        known = replace(identified("I", 0.69), error=0.005)
        return pick(
            compare({"I": law}, {"I": known}, mode_frequencies=(79.0,), amplitude_pp=amplitude_pp), "I", "k22"
        ).verdict

    assert verdict(5e-5) is Agreement.AGREE
    assert verdict(1e-5) is Agreement.DIFFER


def test_an_amplitude_below_the_measured_ones_is_said_and_has_a_wider_interval(law: JointLaw) -> None:
    def found(amplitude_pp: float) -> ElementComparison:
        known = {"I": identified("I")}
        return pick(compare({"I": law}, known, mode_frequencies=(79.0,), amplitude_pp=amplitude_pp), "I", "k22")

    inside, below = found(1e-5), found(3e-6)
    assert "0.003 mm is below the measured 0.01 mm" in below.basis
    assert below.direct.high - below.direct.low > 3 * (inside.direct.high - inside.direct.low)


def test_points_are_taken_at_the_amplitude_nearest_to_the_blows() -> None:
    direct, inverse = both(scale=0.5)
    blows = {name: JointAmplitude(np.array(each)) for name, each in (("I", (8e-5, 6e-5)), ("II", (9e-5, 9e-5)))}
    found = compare(direct, inverse, mode_frequencies=(78.0, 80.0), amplitude_pp=blows)
    assert pick(found, "I", "k22").amplitude_pp == pytest.approx(1e-4)


def test_points_are_read_at_each_modes_own_amplitude() -> None:
    """The larger amplitude is half as stiff; a mode that is not compared says nothing of the others' amplitude."""
    direct, inverse = both()
    own = {"I": (8e-5, 1e-7), "II": (8e-5, 1e-7)}
    asked = {name: JointAmplitude(np.array(each)) for name, each in own.items()}
    found = compare(direct, inverse, mode_frequencies=(79.0, 469.0), amplitude_pp=asked)
    k22 = pick(found, "I", "k22")
    assert k22.direct.value == pytest.approx(0.5 * (A + B).real, rel=1e-6)
    assert k22.amplitude_pp == pytest.approx(1e-4)
    assert k22.basis == "at the modes 79.0 Hz"
    both_seen = pick(compare(direct, inverse, mode_frequencies=(79.0, 150.0), amplitude_pp=asked), "I", "k22")
    assert both_seen.direct.value == pytest.approx((0.5 + 1.0) / 2 * (A + B).real, rel=1e-6)
    assert both_seen.basis == "at the modes 79.0, 150.0 Hz and 0.1, 0.01 mm"


def test_a_law_without_amplitude_or_modes_is_refused(law: JointLaw) -> None:
    inverse = {"I": identified("I")}
    with pytest.raises(AnalysisError, match="has to be told"):
        compare({"I": law}, inverse, mode_frequencies=(79.0,))
    with pytest.raises(AnalysisError, match="has to be told"):
        compare({"I": law}, inverse, amplitude_pp=1e-5)
    with pytest.raises(AnalysisError, match="2 amplitudes for 1 modes"):
        compare(
            {"I": law}, inverse, mode_frequencies=(79.0,), amplitude_pp={"I": JointAmplitude(np.array([1e-5, 2e-5]))}
        )
    with pytest.raises(AnalysisError, match="joint I has no amplitude"):
        compare({"I": law}, inverse, mode_frequencies=(79.0,), amplitude_pp={})


def test_what_scatters_over_the_blows_is_said_and_widens_the_direct_interval(law: JointLaw) -> None:
    def found(log_error: float | None) -> ElementComparison:
        error = None if log_error is None else np.array([log_error])
        blows = {"I": JointAmplitude(np.array([2e-5]), error, 99, "from 100 blows")}
        known = {"I": identified("I")}
        return pick(compare({"I": law}, known, mode_frequencies=(79.0,), amplitude_pp=blows), "I", "k22")

    sure, scattered = found(None), found(0.2)
    assert sure.basis == "by the fitted law at the modes 79.0 Hz and 0.02 mm, from 100 blows"
    assert scattered.basis == ("by the fitted law at the modes 79.0 Hz and 0.02 (0.0134 .. 0.0297) mm, from 100 blows")
    assert sure.amplitude_ci95 is None
    assert scattered.amplitude_ci95 == pytest.approx((1.345e-5, 2.974e-5), rel=1e-3)
    assert scattered.direct.value == sure.direct.value
    # 15 % for each doubling of amplitude, so k times 0.85^(0.2 / ln 2), and that 1.96 times
    moved = 1.96 * 0.2 * math.log(1 / 0.85) / math.log(2) * sure.direct.value
    added = math.sqrt(
        (scattered.direct.high - scattered.direct.value) ** 2 - (sure.direct.high - sure.direct.value) ** 2
    )
    assert added == pytest.approx(moved, rel=0.15)
