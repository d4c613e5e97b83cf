"""Effects of the elastomer tester itself."""

from typing import ClassVar

import numpy as np

from analysis.frequency_response import Complex, Real
from analysis.gap.effect import Effect, Given, Mechanism
from analysis.gap.measurement import Configuration, TesterPoints
from analysis.gap.parameter import Parameter
from analysis.gap.smooth_curve import SmoothCurve

SHARES = tuple(f"share_{configuration.name.lower()}" for configuration in Configuration)
"""Names of parameters: a property of the fixture of each configuration, relative to the mean."""
OF_FIXTURES = tuple(Parameter(name, "1", 1.0, 0.15) for name in SHARES)


def _shares(given: Given, points: TesterPoints) -> Real:
    """(points,) property of the fixture at each point, relative to the mean."""
    return np.array([given[name] for name in SHARES])[points.configuration]


class FrameCompliance(Effect):
    """The frame gives way in series with the specimen: 1/k + c, up to 0.5 um/N for a light frame."""

    id = "frame_compliance"
    title = "compliance of the tester's frame"
    mechanism = Mechanism.TESTER
    law = "elastic"
    reduces_motion = True
    own_parameters: ClassVar[tuple[Parameter, ...]] = (Parameter("c", "m/N", 0.0, 0.33e-6, least=0.0),)

    def tester(self, given: Given, stiffness: Complex, points: TesterPoints) -> Complex:
        return stiffness / (1 + given["c"] * stiffness)


class LossyFrame(FrameCompliance):
    """The frame loses energy too, in bolted joints and seals: c (1 - i loss)."""

    law = "with loss"
    own_parameters = (*FrameCompliance.own_parameters, Parameter("loss", "1", 0.0, 0.03, least=0.0))

    def tester(self, given: Given, stiffness: Complex, points: TesterPoints) -> Complex:
        return stiffness / (1 + given["c"] * (1 - 1j * given["loss"]) * stiffness)


class ComplianceOfEachFixture(FrameCompliance):
    """Fixtures give way as well, and each configuration has its own."""

    law = "a fixture for each configuration"
    own_parameters = (*LossyFrame.own_parameters, *OF_FIXTURES)

    def tester(self, given: Given, stiffness: Complex, points: TesterPoints) -> Complex:
        compliance = given["c"] * _shares(given, points) * (1 - 1j * given["loss"])
        return np.asarray(stiffness / (1 + compliance * stiffness))


class FixtureInertia(Effect):
    """Mass between specimen and force transducer, up to 0.2 kg: k - w^2 m."""

    id = "fixture_inertia"
    title = "inertia of the tester's fixture"
    mechanism = Mechanism.TESTER
    law = "one fixture"
    form_is_known = True
    own_parameters: ClassVar[tuple[Parameter, ...]] = (Parameter("m", "kg", 0.0, 0.133, least=0.0),)

    def tester(self, given: Given, stiffness: Complex, points: TesterPoints) -> Complex:
        return stiffness - given["m"] * (2 * np.pi * points.frequency) ** 2


class InertiaOfEachFixture(FixtureInertia):
    """Each configuration has a fixture of its own, and masses differ a little."""

    law = "a fixture for each configuration"
    own_parameters = (*FixtureInertia.own_parameters, *OF_FIXTURES)

    def tester(self, given: Given, stiffness: Complex, points: TesterPoints) -> Complex:
        return np.asarray(stiffness - given["m"] * _shares(given, points) * (2 * np.pi * points.frequency) ** 2)


class FrameResonance(Effect):
    """The frame resonates at 250 to 800 Hz and magnifies readings below: 1 / (1 - (f / f_r)^2)."""

    id = "frame_resonance"
    title = "resonance of the tester's frame"
    mechanism = Mechanism.TESTER
    law = "without loss"
    own_parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter("f_r", "Hz", 450.0, 0.5, positive=True, starts=(0.0, 1.2)),
    )

    def tester(self, given: Given, stiffness: Complex, points: TesterPoints) -> Complex:
        return stiffness / (1 - (points.frequency / given["f_r"]) ** 2)


class DampedResonance(FrameResonance):
    """`FrameResonance` with a damping ratio; the mode makes a share of the frame's motion, a higher one the rest."""

    law = "with loss"
    own_parameters = (
        *FrameResonance.own_parameters,
        Parameter("zeta", "1", 0.01, 1.0, positive=True),
        Parameter("share", "1", 1.0, 0.2),
        Parameter("second_over_first", "1", 2.5, 0.4, positive=True),
    )

    def tester(self, given: Given, stiffness: Complex, points: TesterPoints) -> Complex:
        first = points.frequency / given["f_r"]
        one, other = (
            1 / (1 - ratio**2 + 2j * given["zeta"] * ratio) for ratio in (first, first / given["second_over_first"])
        )
        return np.asarray(stiffness * (given["share"] * one + (1 - given["share"]) * other))


class TransducerLag(Effect):
    """Force leads displacement by different filters: e^(i w tau), up to 300 us."""

    id = "transducer_lag"
    title = "lag between the tester's transducers"
    mechanism = Mechanism.TESTER
    law = "delay"
    own_parameters: ClassVar[tuple[Parameter, ...]] = (Parameter("tau", "s", 0.0, 200e-6),)

    def tester(self, given: Given, stiffness: Complex, points: TesterPoints) -> Complex:
        return np.asarray(stiffness * np.exp(2j * np.pi * points.frequency * given["tau"]))


class FilteredDisplacement(TransducerLag):
    """Displacement passes a filter of first order that force does not pass."""

    law = "filter of first order"

    def tester(self, given: Given, stiffness: Complex, points: TesterPoints) -> Complex:
        return np.asarray(stiffness * (1 + 2j * np.pi * points.frequency * given["tau"]))


OVER_SWEEP = SmoothCurve((10.0, 60.0, 200.0))


class VaryingLag(TransducerLag):
    """Filters whose delay changes over the sweep, by a third or so: orders differ, or one channel is AC-coupled."""

    law = "delay that changes"
    own_parameters = (*TransducerLag.own_parameters, *OVER_SWEEP.parameters("more", 0.3))

    def tester(self, given: Given, stiffness: Complex, points: TesterPoints) -> Complex:
        late = given["tau"] * (1 + OVER_SWEEP.at(given, "more", points.frequency))
        return np.asarray(stiffness * np.exp(2j * np.pi * points.frequency * late))


class SmoothTester(Effect):
    """Any smooth complex factor over frequency, a different one for each configuration."""

    id = "tester"
    title = "another gain or phase of the tester"
    mechanism = Mechanism.TESTER
    law = "smooth curve"
    law_free = True
    own_parameters = tuple(
        parameter
        for configuration in Configuration
        for name, spread in (("gain", 0.1), ("phase", 0.05))
        for parameter in OVER_SWEEP.parameters(f"{name}_{configuration.name.lower()}", spread)
    )

    def tester(self, given: Given, stiffness: Complex, points: TesterPoints) -> Complex:
        factor = np.zeros(points.order.size, dtype=complex)
        for configuration in Configuration:
            gain, phase = (
                OVER_SWEEP.at(given, f"{name}_{configuration.name.lower()}", points.frequency)
                for name in ("gain", "phase")
            )
            factor += np.where(points.configuration == configuration, gain + 1j * phase, 0.0)
        return np.asarray(stiffness * np.exp(factor))
