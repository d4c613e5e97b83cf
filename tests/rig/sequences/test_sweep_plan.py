"""The order of a sweep: whatever is shuffled, every point is measured once, and the seed says in which order."""

from itertools import groupby, product

from hypothesis import given
from hypothesis import strategies as st

from rig.sequences.sweep_plan import MountedSines, Order, SweepPlan

names = st.lists(st.text(min_size=1, max_size=3), min_size=1, max_size=4, unique=True).map(tuple)
values = st.lists(st.floats(1e-6, 200.0), min_size=1, max_size=6, unique=True).map(tuple)
seeds = st.integers(0, 2**53 - 1)


def flat(mountings: tuple[MountedSines, ...]) -> list[tuple[str, str, float, float]]:
    return [
        (mounting.specimen, mounting.configuration, sine.amplitude_pp, sine.frequency)
        for mounting in mountings
        for sine in mounting.sines
    ]


@given(names, names, values, values, st.sampled_from(Order), seeds)
def test_an_order_is_a_permutation_numbered_from_one_and_the_same_each_time(
    specimens: tuple[str, ...],
    configurations: tuple[str, ...],
    amplitudes: tuple[float, ...],
    frequencies: tuple[float, ...],
    order: Order,
    seed: int,
) -> None:
    plan = SweepPlan(
        frequencies, amplitudes, configurations=configurations, specimens=specimens, order=order, seed=seed
    )
    mountings = plan.mountings()
    assert sorted(flat(mountings)) == sorted(product(specimens, configurations, amplitudes, frequencies))
    numbers = [sine.order_number for mounting in mountings for sine in mounting.sines]
    assert numbers == list(range(1, len(numbers) + 1))
    assert plan.mountings() == mountings


@given(st.sampled_from(Order), seeds)
def test_specimens_are_mounted_once_and_amplitudes_measured_as_series(order: Order, seed: int) -> None:
    plan = SweepPlan(order=order, seed=seed)
    mountings = plan.mountings()
    assert len({(mounting.specimen, mounting.configuration) for mounting in mountings}) == len(mountings) == 6
    for mounting in mountings:
        series = [key for key, _ in groupby(sine.amplitude_pp for sine in mounting.sines)]
        assert sorted(series) == sorted(plan.amplitudes_pp)


def sequential_levels(mountings: tuple[MountedSines, ...], plan: SweepPlan) -> tuple[bool, bool, bool]:
    """Whether mountings, amplitudes and frequencies come as the plan gives them."""
    mounted = [(mounting.specimen, mounting.configuration) for mounting in mountings]
    series = [
        (amplitude, [sine.frequency for sine in sines])
        for mounting in mountings
        for amplitude, sines in groupby(mounting.sines, key=lambda sine: sine.amplitude_pp)
    ]
    return (
        mounted == list(product(plan.specimens, plan.configurations)),
        [amplitude for amplitude, _ in series] == list(plan.amplitudes_pp) * len(mountings),
        all(frequencies == list(plan.frequencies) for _, frequencies in series),
    )


def test_each_order_shuffles_its_own_parts_only() -> None:
    found = {}
    for order in Order:
        plan = SweepPlan(order=order, seed=11)
        found[order] = sequential_levels(plan.mountings(), plan)
    assert found == {
        Order.SEQUENTIAL: (True, True, True),
        Order.AMPLITUDES: (True, False, True),
        Order.MOUNTINGS: (False, False, True),
        Order.ALL: (False, False, False),
    }


def test_another_seed_is_another_order() -> None:
    orders = {tuple(flat(SweepPlan(order=Order.ALL, seed=seed).mountings())) for seed in range(20)}
    assert len(orders) == 20


def test_an_order_once_drawn_stays_whatever_python_resumes_it() -> None:
    drawn = SweepPlan((5.0, 10.0, 15.0), configurations=("shear", "angled"), order=Order.ALL, seed=7).mountings()
    mounted = [(each.specimen, each.configuration) for each in drawn]
    assert mounted == [("II", "angled"), ("I", "angled"), ("I", "shear"), ("II", "shear")]
    series = {
        amplitude: [sine.frequency for sine in sines]
        for amplitude, sines in groupby(drawn[0].sines, key=lambda sine: sine.amplitude_pp)
    }
    assert series == {1e-5: [10.0, 15.0, 5.0], 5e-5: [5.0, 10.0, 15.0], 1e-4: [10.0, 15.0, 5.0]}


def test_points_at_multiples_of_the_mains_are_driven_a_cycle_of_the_record_beside_them_and_stay_in_the_plan() -> None:
    plan = SweepPlan(mains_frequency=50)
    sines = plan.mountings()[0].sines[:40]
    moved = {sine.frequency: sine.driven_frequency for sine in sines if sine.driven_frequency != sine.frequency}
    assert moved == {50.0: 48.0, 100.0: 98.0, 150.0: 148.0, 200.0: 198.0}
    assert [sine.frequency for sine in sines] == list(plan.frequencies)


@given(st.floats(1.0, 500.0), st.sampled_from([50, 60]), st.integers(2, 40), st.floats(0.0, 3.0))
def test_no_point_is_less_than_a_cycle_from_a_multiple_and_none_moves_that_is_clear(
    frequency: float, mains: int, cycles: int, shortest: float
) -> None:
    plan = SweepPlan(mains_frequency=mains, fewest_cycles=cycles, shortest_record=shortest)
    driven = plan.driven_frequency(frequency)
    hum = mains * max(1, round(frequency / mains))
    apart = 1 / plan.record_duration(hum, 0.0, plan.tolerance)
    assert driven > 0
    assert abs(driven - hum) >= 0.999 * apart
    assert abs(driven - frequency) <= 1.001 * apart
    assert driven == frequency or abs(frequency - hum) < apart


def test_a_plan_that_does_not_know_the_mains_moves_nothing() -> None:
    assert all(sine.driven_frequency == sine.frequency for each in SweepPlan().mountings() for sine in each.sines)
