"""A case in front of the instruments: the same accelerances and stiffnesses as its files, from blows and cycling."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from simlab.actuator import Actuator
from simlab.beam import free_modes
from simlab.bench import SimulatedBench, case_bench, ordinary_bench
from simlab.beside_the_beam import SUSPENDED_MASS, TONE, TONE_RMS
from simlab.case.blows import RECORD_SECONDS
from simlab.case.bundle import commitment, write_case
from simlab.case.campaign import CONFIGURATIONS, MEASURED, ROWS, Row
from simlab.case.draw import Case, CaseKind, draw_case
from simlab.case.random_case import draw_random_case
from simlab.case.simulate import simulate
from simlab.clock import Clock
from simlab.laboratory import Laboratory, LaboratoryProcess
from simlab.stand import BuiltCase, Stand

RATE, SAMPLES = 5120.0, 15360


def quiet(case: Case) -> Case:
    campaign = replace(case.campaign, force_noise=0.0, acceleration_noise=0.0, place_scatter=0.0)
    return replace(case, campaign=campaign)


def bench_of(kind: CaseKind, *effects: str, seed: int = 4, size: float = 0.6) -> SimulatedBench:
    return case_bench(quiet(draw_case(seed, kind, effects, size)), Clock())


def accelerance_of_blow(bench: SimulatedBench, node: int, direction: str) -> tuple[np.ndarray, np.ndarray]:
    bench.strike(node, direction, at=1.00003, what="clean")
    signals = bench.hammer_signals(0.9, RATE, SAMPLES)
    frequency = np.asarray(np.fft.rfftfreq(SAMPLES, 1 / RATE), dtype=np.float64)
    lines = (frequency >= 20.0) & (frequency <= 1000.0)
    force, acceleration = (np.fft.rfft(signals[name])[lines] for name in ("hammer", "accelerometer"))
    return frequency[lines], acceleration / force


@pytest.mark.parametrize(
    ("kind", "effects"),
    [
        (CaseKind.NONE, []),
        (CaseKind.SINGLE, ["foundation_compliance"]),
        (CaseKind.SINGLE, ["channel_delay"]),
        (CaseKind.SINGLE, ["impact_position"]),
        (CaseKind.NOVEL, ["roving_drift"]),
    ],
)
def test_a_blow_shows_the_accelerance_of_the_file(kind: CaseKind, effects: list[str]) -> None:
    bench = bench_of(kind, *effects)
    bench.set_up(1)
    frequency, measured = accelerance_of_blow(bench, 9, "y")
    # the blow's own peak force matters to none of these effects
    filed = simulate(bench.case, frequency=frequency).accelerance[1, ROWS.index(Row(9, "y"))]
    np.testing.assert_allclose(measured, filed, rtol=2e-3, atol=2e-4 * np.abs(filed).max())


def test_a_harder_blow_meets_softer_rubber_where_the_case_has_it_so() -> None:
    bench = bench_of(CaseKind.SINGLE, "amplitude_dependence")
    frequency = np.array([50.0, 60.0])
    soft, hard = (np.abs(bench.accelerance(frequency, 3, "y", force)) for force in (100.0, 400.0))
    assert np.all(hard > soft)
    filed = simulate(bench.case, frequency=frequency).accelerance[0, ROWS.index(Row(3, "y"))]
    np.testing.assert_allclose(soft, np.abs(filed), rtol=1e-9)


@pytest.mark.parametrize("name", ["amplitude_dependence", "coulomb_friction", "cubic_stiffness"])
def test_joints_that_follow_each_blow_do_so_at_the_instruments(name: str) -> None:
    case = draw_random_case(4, CaseKind.SINGLE, [name]).repeatable()
    frequency = np.arange(20.0, 1000.0, 7.0)
    filed = simulate(case, frequency=frequency).accelerance[0]
    for row in (Row(3, "y"), Row(9, "y")):
        found = case_bench(case, Clock()).accelerance(frequency, row.node, row.direction)
        np.testing.assert_allclose(found, filed[ROWS.index(row)], rtol=1e-9)


@pytest.mark.parametrize(
    "effects",
    [
        ["frame_compliance"],
        ["transducer_lag"],
        ["amplitude_dependence"],
        ["cylinder_angle"],
        ["joint_mass"],
        ["amplitude_dependence", "frame_compliance"],
    ],
)
def test_the_tester_meets_the_stiffness_of_the_file(effects: list[str]) -> None:
    bench = bench_of(CaseKind.PAIR if len(effects) == 2 else CaseKind.SINGLE, *effects)
    points, filed = bench.case.campaign.points, simulate(bench.case, frequency=np.array([100.0])).stiffness
    for i in range(0, 720, 45):
        bench.mount(("I", "II")[points.specimen[i]], CONFIGURATIONS[points.configuration[i]])
        found = bench.dynamic_stiffness(float(points.amplitude[i]), float(points.frequency[i]))
        assert found == pytest.approx(complex(filed[i]), rel=1e-9)


@pytest.mark.parametrize("draw", [draw_case, draw_random_case])
@pytest.mark.parametrize("name", ["sensor_gain", "channel_delay", "highpass_corner"])
@pytest.mark.parametrize("place", ["calibrator", "mass"])
def test_what_is_wrong_with_the_chain_shows_beside_the_beam_too(
    draw: Callable[..., Case], name: str, place: str
) -> None:
    """A known-mass ratio test is what tells a gain; line by line against the chain's closed form."""
    case = quiet(draw(4, CaseKind.SINGLE, [name]))
    bench = case_bench(case, Clock())
    bench.mount("accelerometer", place)
    signals = bench.hammer_signals(2.0, RATE, 5120)
    heard = np.fft.rfft(
        signals["accelerometer"] * np.hanning(5120) if place == "calibrator" else signals["accelerometer"]
    )
    lines = np.array([159]) if place == "calibrator" else np.arange(5, 300)
    omega = 2 * np.pi * (np.array([TONE]) if place == "calibrator" else lines.astype(float))
    expected = case.campaign.setups[0].gain * case.effects[0].passed(omega.astype(np.complex128))
    if place == "mass":
        found = heard[lines] / np.fft.rfft(signals["hammer"])[lines] * SUSPENDED_MASS
    else:
        time = 2.0 + np.arange(5120) / RATE
        clean = np.sqrt(2) * TONE_RMS * np.sin(2 * np.pi * TONE * time)
        found = heard[lines] / np.fft.rfft(clean * np.hanning(5120))[lines]
    np.testing.assert_allclose(found, expected, rtol=1e-4)


@pytest.mark.parametrize("draw", [draw_case, draw_random_case])
def test_a_frame_that_gives_shows_nothing_in_an_empty_tester(draw: Callable[..., Case]) -> None:
    bench = case_bench(draw(4, CaseKind.SINGLE, ["frame_compliance"]), Clock())
    bench.mount("empty", "blank")
    assert bench.dynamic_stiffness(np.array([5e-6, 5e-5]), 50.0).tolist() == [0.0, 0.0]
    bench.mount("blank", "blank")
    assert abs(bench.dynamic_stiffness(5e-5, 50.0)) < 0.5 * 2e8


def test_a_conditioning_drift_goes_with_the_work_done() -> None:
    bench = bench_of(CaseKind.SINGLE, "conditioning_drift", size=1.0)
    clock = iter(np.arange(0.0, 1e4, 1.0))
    actuator = Actuator(bench, lambda: float(next(clock)))
    bench.attach_actuator(actuator)
    bench.mount("I", "compression")
    before = bench.dynamic_stiffness(25e-6, 50.0).real
    for _ in range(12):
        actuator.cycle(1e-4, 50.0)
    after = bench.dynamic_stiffness(25e-6, 50.0).real
    assert after < before * (1 - 1e-3)


def test_a_bouncing_case_bounces_and_a_humming_one_hums() -> None:
    bouncing = bench_of(CaseKind.SINGLE, "double_hit")
    for number in range(10):
        bouncing.strike(3, "y", at=1.0 + 3 * number)
    assert any(len(blow.pulses) == 2 for blow in bouncing.blows)
    humming = bench_of(CaseKind.SINGLE, "mains_hum")
    silence = humming.hammer_signals(0.0, RATE, SAMPLES)["accelerometer"]
    spectrum = np.abs(np.fft.rfft(silence))
    assert np.argmax(spectrum) * RATE / SAMPLES in (pytest.approx(50.0, abs=0.4), pytest.approx(60.0, abs=0.4))


def test_a_blow_has_about_the_peak_force_of_the_set() -> None:
    bench = bench_of(CaseKind.NONE)
    bench.strike(3, "y", at=1.0, what="clean")
    assert 0.5 < bench.blows[0].peak_force / bench.case.campaign.setups[0].peak_force < 1.5


@pytest.mark.parametrize("rate", [2560.0, 5120.0, 25600.0])
def test_a_record_has_the_noise_of_the_case_at_any_rate(rate: float) -> None:
    """As a spectrum in N s and m/s^2 s over a record of the campaign's length, of which a case states it."""
    bench = case_bench(draw_case(4, CaseKind.NONE), Clock())
    samples = round(RECORD_SECONDS * rate)
    signals = bench.hammer_signals(0.0, rate, samples)
    for name, expected in (("hammer", "force_noise"), ("accelerometer", "acceleration_noise")):
        spectrum = np.fft.rfft(signals[name])[1 : round(1000 * RECORD_SECONDS)] / rate
        found = np.sqrt(np.mean(np.abs(spectrum) ** 2))
        assert found == pytest.approx(getattr(bench.case.campaign, expected), rel=0.05)


def test_a_hammer_set_after_a_sweep_has_the_temperature_of_the_beam() -> None:
    case = next(
        case
        for case in (draw_case(seed, CaseKind.SINGLE, ["temperature_shift"], 1.0) for seed in range(20))
        if case.effects[0].values["thermometer"] == "shows"
    )
    bench = case_bench(case, Clock())
    beam = bench.temperature(0.0)
    bench.mount("I", "shear")
    assert abs(bench.temperature(0.0) - beam) > 9.0
    bench.strike(3, "y", at=1.0)
    assert bench.temperature(0.0) == beam
    bench.mount("I", "shear")
    bench.set_up(1)
    assert bench.temperature(0.0) == pytest.approx(beam, abs=1.0)


def test_a_case_hangs_its_own_beam_in_cords() -> None:
    bench = bench_of(CaseKind.SINGLE, "density", size=1.0)
    bench.mount("beam", "suspended")
    frequency, measured = accelerance_of_blow(bench, 8, "y")
    free = free_modes(bench.built.article.beam).frequency[3:6]
    assert min(abs(frequency[np.argmax(np.abs(measured))] - free)) < 1.0


def test_the_ordinary_bench_is_a_case_without_effects() -> None:
    bench = ordinary_bench(3, Clock())
    assert bench.case.effects == ()
    filed = simulate(bench.case)
    row = filed.rows.index(Row(9, "y"))
    np.testing.assert_allclose(bench.accelerance(filed.frequency, 9, "y"), filed.accelerance[0, row], rtol=1e-9)
    points = bench.case.campaign.points
    bench.mount("I", "compression")
    assert (points.specimen[0], points.configuration[0]) == (0, 0)
    found = bench.dynamic_stiffness(float(points.amplitude[0]), float(points.frequency[0]))
    assert found == pytest.approx(complex(filed.stiffness[0]), rel=3e-3)  # today's temperature
    assert bench.commitment() == commitment(bench.open_seal())


def test_a_set_that_the_case_has_not_is_refused() -> None:
    with pytest.raises(ValueError, match="no set 7"):
        bench_of(CaseKind.NONE).set_up(7)


def test_a_laboratory_takes_a_case_and_reveals_its_truth() -> None:
    case = draw_case(8, CaseKind.SINGLE, ["joint_mass"])
    with Laboratory(speed=100.0, case=case) as laboratory:
        assert laboratory.bench.truth()["effects"] == ["joint_mass"]


def test_a_laboratory_of_its_own_process_takes_a_case_by_seed() -> None:
    with LaboratoryProcess(seed=8, speed=100.0, kind="single", effects=["density"]) as process:
        process.operator.do("set_up", number=1)
        process.operator.do("mount", specimen="I", configuration="shear")
        process.operator.do("strike", node=3, direction="y")
        assert process.operator.do("truth")["effects"] == ["density"]


def test_the_joints_that_should_be_found_are_those_of_the_paper_and_the_effect() -> None:
    plain = bench_of(CaseKind.NONE).truth()
    np.testing.assert_allclose(plain["inverse"]["I"]["k"], plain["joints"]["I"]["k"], rtol=1e-9, atol=1e-6)
    heavy = bench_of(CaseKind.SINGLE, "joint_mass").truth()
    assert heavy["inverse"]["I"]["k"][1][1] < heavy["joints"]["I"]["k"][1][1] - 1e4
    assert json.loads(json.dumps(heavy)) == heavy


def test_the_joints_that_should_be_found_are_those_that_blows_meet() -> None:
    case = draw_random_case(4, CaseKind.SINGLE, ["coulomb_friction"]).repeatable()
    stand, campaign = Stand(BuiltCase.of(case), np.linspace(77.0, 900.0, 200)), case.campaign
    force = campaign.setups[0].peak_force
    loads = np.array([campaign.straight(row).in_plane(stand.modes) for row in MEASURED])
    met = [stand.support_stiffness(0, 0.5, force, felt) for felt in stand._felt(0, MEASURED, loads, force)]
    stated = case_bench(case, Clock()).truth()["inverse"]["I"]["h"]
    # marks are off by a millimetre or two
    np.testing.assert_allclose(stated, np.mean(met, axis=(0, 1))[:3, :3].imag, rtol=0.02, atol=1e3)


def test_a_window_of_the_records_is_no_damping_of_the_joints() -> None:
    mass, both = (
        bench_of(kind, *effects).truth()["inverse"]["I"]["h"]
        for kind, effects in (
            (CaseKind.SINGLE, ["joint_mass"]),
            (CaseKind.PAIR, ["joint_mass", "exponential_window"]),
        )
    )
    np.testing.assert_allclose(both, mass, rtol=1e-9, atol=1e-6)


def test_the_drawing_is_the_setup_of_the_bundle(tmp_path: Path) -> None:
    bench = case_bench(draw_case(4, CaseKind.SINGLE, ["joint_mass"]), Clock())
    write_case(bench.case, tmp_path)
    stated = json.loads((tmp_path / "setup.json").read_text(encoding="utf-8"))
    assert json.loads(json.dumps(bench.drawing())) == stated
