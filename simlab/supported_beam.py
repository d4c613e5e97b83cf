"""The article in its stand or in cords: what the accelerometer sees of a force, in plane and, a little, out of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from simlab.article import Article
from simlab.assembly import Assembly, Complex, Lines
from simlab.beam import FreeModes, Real, free_modes
from simlab.elastomer import REFERENCE_TEMPERATURE


@dataclass(frozen=True)
class Load:
    """What a unit force on the bar is at its axis: components in x, y, z and moments in (r) and out of plane (s), m."""

    position: float
    x: float = 0.0
    y: float = 0.0
    r: float = 0.0
    z: float = 0.0
    s: float = 0.0


@dataclass(frozen=True)
class PlaneLines:
    """Frequency lines prepared for the plane of bending and for the one across it."""

    in_plane: Lines
    out_of_plane: Lines


class Support(Protocol):
    """What holds the bar somewhere: a joint, or a cord."""

    @property
    def position(self) -> float:
        """In m from the left end."""

    def dynamic_stiffness(self, amplitude: float, frequency: Real, temperature: float) -> Complex:
        """(lines, 3, 3) k + ih in x, y and rotation."""

    def lateral_stiffness(self, amplitude: float, frequency: Real, temperature: float) -> Complex:
        """(lines, 2, 2) k + ih out of plane, sideways and in rotation."""


class SupportedBeam:
    """Beam on its two joints, or on other `supports`; `cross_axis` is how much of z the accelerometer takes for y."""

    def __init__(
        self, article: Article, cross_axis: float = 0.0, supports: Mapping[str, Support] | None = None
    ) -> None:
        self.article = article
        self.supports: Mapping[str, Support] = article.joints if supports is None else supports
        self.cross_axis = cross_axis
        self.free = free_modes(article.bar)
        self.free_across = free_modes(article.bar.on_edge())
        places = [joint.position for joint in self.supports.values()]
        self.in_plane = Assembly(self.free, _rows(self.free, places, "xyr"))
        self.out_of_plane = Assembly(self.free_across, _rows(self.free_across, places, "yr"))

    def lines(self, frequency: Real) -> PlaneLines:
        """Prepare frequency lines (lines,) in Hz, all above zero."""
        return PlaneLines(self.in_plane.lines(frequency), self.out_of_plane.lines(frequency))

    def accelerance(
        self, lines: PlaneLines, load: Load, amplitude: float, temperature: float = REFERENCE_TEMPERATURE
    ) -> Complex:
        """(lines,) accelerometer reading per force, (m/s^2)/N, with the cylinders deformed by `amplitude` m."""
        frequency, sensor = lines.in_plane.frequency, self.article.sensor_position
        total = self.in_plane.accelerance(
            lines.in_plane,
            self.joint_stiffness(amplitude, frequency, temperature),
            self.free.shape("y", sensor),
            sum(getattr(load, d) * self.free.shape(d, load.position) for d in "xyr"),
        )
        if self.cross_axis and (load.z or load.s):
            joints = [j.lateral_stiffness(amplitude, frequency, temperature) for j in self.supports.values()]
            across = load.z * self.free_across.shape("y", load.position)
            across = across + load.s * self.free_across.shape("r", load.position)
            total = total + self.cross_axis * self.out_of_plane.accelerance(
                lines.out_of_plane, _side_by_side(joints), self.free_across.shape("y", sensor), across
            )
        return total

    def joint_stiffness(self, amplitude: float, frequency: Real, temperature: float) -> Complex:
        """(lines, 6, 6) dynamic stiffness of both supports in x, y, rotation of the first, then of the second."""
        return _side_by_side(
            [joint.dynamic_stiffness(amplitude, frequency, temperature) for joint in self.supports.values()]
        )

    def poles(self, amplitude: float, highest: float = 1024.0) -> Complex:
        """(poles,) of the supported beam in its plane up to `highest` Hz, rad/s, sorted."""
        return self.in_plane.poles(
            lambda frequency: self.joint_stiffness(amplitude, np.array([frequency]), REFERENCE_TEMPERATURE)[0], highest
        )


def _rows(modes: FreeModes, places: list[float], directions: str) -> Real:
    return np.array([modes.shape(direction, place) for place in places for direction in directions])


def _side_by_side(blocks: list[Complex]) -> Complex:
    """Square blocks (lines, n, n) on the diagonal of one matrix (lines, N, N)."""
    lines, size = blocks[0].shape[:2]
    whole = np.zeros((lines, size * len(blocks), size * len(blocks)), dtype=np.complex128)
    for i, block in enumerate(blocks):
        whole[:, i * size : (i + 1) * size, i * size : (i + 1) * size] = block
    return whole
