"""The measurement of a case: the roving-hammer sets, the tester's points in their order, and every noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simlab.article import JOINT_NAMES, TOLERANCES, clipped_normal, log_uniform
from simlab.beam import Load, Real
from simlab.case.drawing import PAPER, BenchKind
from simlab.case.nuisances import Nuisances

CONFIGURATIONS = ("compression", "shear", "angled")
AMPLITUDES_PP_MM = PAPER.amplitudes_pp_mm
SINE_FREQUENCIES = PAPER.sine_frequencies
LINE_SPACING = 0.5
HIGHEST_LINE = 1024.0
AVERAGES = 10
PRESET_MM = 0.5
NODES = 11
REMOUNTING_SECONDS = 600.0
USUAL = 0.7
"""Share of the campaigns that use the first entry of `levels` of their kind of bench."""


@dataclass(frozen=True)
class Row:
    """One place and direction in which the hammer strikes."""

    node: int
    direction: str

    @property
    def name(self) -> str:
        """The point's name, such as 5y."""
        return f"{self.node}{self.direction}"


MEASURED = (*(Row(node, "y") for node in (1, 3, 4, 6, 7, 9, 11)), Row(1, "x"), Row(11, "x"))
WITHHELD = (Row(5, "y"), Row(8, "y"))
ASKED_FOR = (*WITHHELD, Row(2, "y"), Row(10, "y"))
"""Rows that a model is asked to predict: those held back, and those at the joints, where no hammer reaches."""
ROWS = MEASURED + ASKED_FOR
RECORDED = (Row(1, "y"), Row(6, "y"), Row(9, "y"))
"""Rows of which a laboratory that keeps raw blows keeps one blow."""


@dataclass(frozen=True)
class Setup:
    """One roving-hammer set.

    Attributes:
        peak_force: of a blow, N.
        gain: of the measuring chain.
        offsets: (rows measured,) distance of the marks from their drawn places along the beam, m.
        temperature: deg C.
    """

    peak_force: float
    gain: float
    offsets: tuple[float, ...]
    temperature: float


@dataclass(frozen=True, eq=False)
class Points:
    """The tester's sine points in the order of measurement; every array is (points,).

    Attributes:
        order: fraction of the test that is over, 0 to 1.
        time: s from the first point.
        specimen: 0 for the cylinders of joint I, 1 for those of II.
        configuration: index in `CONFIGURATIONS`.
        amplitude_pp_mm, frequency, temperature: mm peak to peak, Hz, deg C.
    """

    order: Real
    time: Real
    specimen: NDArray[np.int64]
    configuration: NDArray[np.int64]
    amplitude_pp_mm: Real
    frequency: Real
    temperature: Real

    @property
    def amplitude(self) -> Real:
        """(points,) m zero to peak."""
        return np.asarray(0.5e-3 * self.amplitude_pp_mm)

    @classmethod
    def alike(
        cls,
        specimen: int,
        configuration: int,
        amplitude_pp_mm: float | Real,
        frequency: Real,
        temperature: float,
        order: float = 0.0,
    ) -> Points:
        """Points at `frequency` (points,) Hz that are the same in everything else."""
        same = np.ones(frequency.size)
        return cls(
            order=order * same,
            time=0.0 * same,
            specimen=np.full(frequency.size, specimen),
            configuration=np.full(frequency.size, configuration),
            amplitude_pp_mm=amplitude_pp_mm * same,
            frequency=frequency,
            temperature=temperature * same,
        )


@dataclass(frozen=True, eq=False)
class Campaign:
    """The measurement: everything but the article.

    Attributes:
        node_positions: (11,) on the drawing, m.
        setups: hammer sets; the first is the reference.
        points: of the tester.
        order_kind: sequential, blocks or random.
        tester_gain: of the tester's stiffness.
        pulse_width: of a blow, s.
        force_noise, acceleration_noise: of one blow's record, N s and m/s^2 s.
        place_scatter: standard deviation of single blows along the beam, m.
        direct_noise: of the tester at 0.1 mm peak to peak, in thousandths of the stiffness; inverse to the amplitude.
        joint_amplitude: deformation of the cylinders under a blow of 100 N, m zero to peak.
        amplitude_fall: power of frequency above 80 Hz with which that amplitude falls; 0 is one amplitude for all.
        recorded: rows of which one raw blow of the reference set is kept.
        drawing: of the bench.
        nuisances: errors that are no effect; None where everything repeats as stated.
        amplitude_power: power of the mean over a record that gives a joint's amplitude; 0 for one amplitude per force.
    """

    node_positions: tuple[float, ...]
    setups: tuple[Setup, ...]
    points: Points
    order_kind: str
    tester_gain: float
    pulse_width: float
    force_noise: float
    acceleration_noise: float
    place_scatter: float
    direct_noise: float
    joint_amplitude: float
    amplitude_fall: float
    recorded: tuple[Row, ...]
    drawing: BenchKind = PAPER
    nuisances: Nuisances | None = None
    amplitude_power: float = 0.0

    @property
    def frequency(self) -> Real:
        """(lines,) Hz, of the accelerances, without the line at zero."""
        return np.asarray(np.arange(1, round(HIGHEST_LINE / LINE_SPACING) + 1) * LINE_SPACING, dtype=np.float64)

    def straight(self, row: Row) -> Load:
        """A straight blow on the drawing's place of `row`."""
        return Load(self.node_positions[row.node - 1], **{row.direction: 1.0})

    def deformation(self, peak_force: float, frequency: Real) -> Real:
        """(lines,) m zero to peak, of the cylinders under a blow of `peak_force` N at `frequency` (lines,) Hz."""
        falling = np.maximum(frequency / 80.0, 1.0) ** -self.amplitude_fall
        return np.asarray(self.joint_amplitude * peak_force / 100.0 * np.maximum(falling, 0.02))


def draw_setup(rng: np.random.Generator, peak_force: float, temperature: float) -> Setup:
    """One set after a new set-up, on a day of about `temperature` deg C.  The ends are struck straight on in x."""
    offsets = clipped_normal(rng, TOLERANCES["impact_position"], len(MEASURED))
    return Setup(
        peak_force=peak_force,
        gain=1.0 + float(clipped_normal(rng, TOLERANCES["sensor_gain"])),
        offsets=tuple(float(d) if row.direction == "y" else 0.0 for d, row in zip(offsets, MEASURED, strict=True)),
        temperature=temperature + 0.2 * float(rng.standard_normal()),
    )


def draw_node_positions(rng: np.random.Generator, drawing: BenchKind = PAPER) -> tuple[float, ...]:
    """Positions of nodes 1 to 11 on the drawing, m: the joints as far from both ends, the others about even between."""
    length = drawing.beam.length
    inset = 1e-3 * float(rng.integers(*drawing.inset_mm))
    inner = np.linspace(inset, length - inset, NODES - 2)
    if drawing.unevenness:
        inner[1:-1] += drawing.unevenness * rng.uniform(-1.0, 1.0, inner.size - 2)
    inner = np.round(inner, 4)
    return (0.0, *(float(x) for x in inner), length)


def draw_campaign(rng: np.random.Generator, drawing: BenchKind = PAPER) -> Campaign:
    """A campaign as a careful lab runs it: a reference set, often its repeat, and one of a harder hammer."""
    nodes = draw_node_positions(rng, drawing)
    temperature = float(rng.uniform(21.0, 25.0))
    usual, *others = drawing.levels
    chance = rng.random()
    forces = usual if chance < USUAL else others[int((chance - USUAL) / (1 - USUAL) * len(others))]
    setups = tuple(draw_setup(rng, force, temperature) for force in forces)
    order_kind = str(rng.choice(["sequential", "blocks", "random"]))
    return Campaign(
        node_positions=nodes,
        setups=setups,
        points=draw_points(rng, order_kind, temperature, drawing),
        order_kind=order_kind,
        tester_gain=1.0 + float(clipped_normal(rng, TOLERANCES["tester_gain"])),
        pulse_width=float(rng.uniform(0.5e-3, 0.95e-3)),
        force_noise=log_uniform(rng, 1e-4, 4e-4),
        acceleration_noise=log_uniform(rng, 1.2e-4, 4.6e-4),
        place_scatter=0.5e-3,
        direct_noise=float(rng.uniform(0.75, 1.6)),
        joint_amplitude=log_uniform(rng, 1e-6, 10e-6),
        amplitude_fall=float(rng.choice([0.0, rng.uniform(1.0, 2.0)], p=[0.6, 0.4])),
        recorded=RECORDED if rng.random() < 0.3 else (),
        drawing=drawing,
    )


def draw_points(rng: np.random.Generator, order_kind: str, temperature: float, drawing: BenchKind = PAPER) -> Points:
    """Every specimen, configuration, amplitude and frequency once: in sequence, mixed within each mounting, or mixed.

    Remounting takes ten minutes; a lab that mixes everything has as many fixtures as configurations.
    """
    grid = [
        (specimen, configuration, amplitude, frequency)
        for specimen in range(len(JOINT_NAMES))
        for configuration in range(len(CONFIGURATIONS))
        for amplitude in drawing.amplitudes_pp_mm
        for frequency in drawing.sine_frequencies
    ]
    table = np.array(grid)
    if order_kind == "random":
        table = rng.permutation(table)
    elif order_kind == "blocks":
        mountings = np.split(table, len(JOINT_NAMES) * len(CONFIGURATIONS))
        table = np.concatenate([rng.permutation(mountings[i]) for i in rng.permutation(len(mountings))])
    count = len(table)
    time = np.cumsum(rng.uniform(9.0, 14.0, count)) - 9.0
    if order_kind != "random":
        mounted = np.any(np.diff(table[:, :2], axis=0) != 0, axis=1)
        time[1:] += REMOUNTING_SECONDS * np.cumsum(mounted)
    return Points(
        order=np.arange(count) / (count - 1),
        time=time,
        specimen=table[:, 0].astype(np.int64),
        configuration=table[:, 1].astype(np.int64),
        amplitude_pp_mm=table[:, 2],
        frequency=table[:, 3],
        temperature=temperature + 0.1 * rng.standard_normal(count),
    )
