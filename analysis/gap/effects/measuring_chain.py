"""Sensors, cables and windows of the beam rig."""

from dataclasses import replace
from typing import ClassVar

import numpy as np

from analysis.frequency_response import Complex, Real
from analysis.gap.bench import BeamBench, Setting
from analysis.gap.effect import Effect, Given, Mechanism
from analysis.gap.effects.beam import ElementAboveTheAxis
from analysis.gap.parameter import Parameter
from analysis.gap.smooth_curve import SmoothCurve

OVER_BAND = SmoothCurve((6.0, 20.0, 80.0, 300.0, 900.0))


class SensorGain(Effect):
    """Sensitivities of hammer or accelerometer are off by up to 5 %: one factor on all accelerances."""

    id = "sensor_gain"
    title = "gain of hammer or accelerometer"
    mechanism = Mechanism.MEASURING_CHAIN
    law = "flat"
    form_is_known = True
    own_parameters: ClassVar[tuple[Parameter, ...]] = (Parameter("gain", "1", 0.0, 0.033),)

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        return replace(bench, chain=bench.chain * (1 + given["gain"]))


class UnevenGain(SensorGain):
    """`SensorGain` that changes by a few tenths of a per cent within the band, as no response is exactly flat."""

    law = "not quite flat"
    form_is_known = False
    own_parameters = (*SensorGain.own_parameters, *OVER_BAND.parameters("uneven", 0.003))

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        return super().beam(given, _scaled(bench, OVER_BAND.at(given, "uneven", setting.frequency)), setting)


def _scaled(bench: BeamBench, exponent: Real | Complex) -> BeamBench:
    """A bench whose chain is multiplied by a factor, given by its logarithm (lines,)."""
    return replace(bench, chain=bench.chain * np.exp(exponent))


class ChannelDelay(Effect):
    """Filters or multiplexed channels delay acceleration against force by up to 50 us."""

    id = "channel_delay"
    title = "delay between the channels"
    mechanism = Mechanism.MEASURING_CHAIN
    law = "one delay"
    form_is_known = True
    own_parameters: ClassVar[tuple[Parameter, ...]] = (Parameter("tau", "s", 0.0, 33e-6),)

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        return _scaled(bench, -given["tau"] * bench.pole)


WHERE_DELAYS_SHOW = SmoothCurve((80.0, 300.0, 900.0))


class DelayOfFilter(ChannelDelay):
    """A filter whose delay changes over its band, by a tenth or so."""

    law = "of a filter"
    form_is_known = False
    own_parameters = (*ChannelDelay.own_parameters, *WHERE_DELAYS_SHOW.parameters("more", 0.1))

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        more = WHERE_DELAYS_SHOW.at(given, "more", setting.frequency)
        return _scaled(bench, -given["tau"] * (1 + more) * bench.pole)


class HighpassCorner(Effect):
    """The IEPE supply couples by a capacitor: a first-order corner at 0.1 to 5 Hz, i w / (i w + w_c)."""

    id = "highpass_corner"
    title = "high-pass corner of the acceleration channel"
    mechanism = Mechanism.MEASURING_CHAIN
    law = "first order"
    own_parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter("corner", "Hz", 0.8, 1.0, positive=True, starts=(-0.5, 1.0)),
    )

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        return replace(bench, chain=bench.chain * bench.pole / (bench.pole + 2 * np.pi * given["corner"]))


class SecondOrderCorner(HighpassCorner):
    """Two stages in a row, of charge amplifier and input."""

    law = "second order"

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        corner = 2 * np.pi * given["corner"]
        passed = bench.pole**2 / (bench.pole**2 + np.sqrt(2) * corner * bench.pole + corner**2)
        return replace(bench, chain=bench.chain * passed)


class TwoCorners(HighpassCorner):
    """Two stages that do not load each other, such as supply and input: each has a corner of its own."""

    law = "two corners"
    own_parameters = (*HighpassCorner.own_parameters, Parameter("second", "1", 0.2, 0.8, positive=True))

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        other = 2 * np.pi * given["corner"] * given["second"]
        return super().beam(given, replace(bench, chain=bench.chain * bench.pole / (bench.pole + other)), setting)


class ExponentialWindow(Effect):
    """An exponential window e^(-s t) on both channels that nobody stated: H at i w + s, in addition to a stated one."""

    id = "exponential_window"
    title = "exponential window not corrected"
    mechanism = Mechanism.MEASURING_CHAIN
    form_is_known = True
    own_parameters = (Parameter("s", "1/s", 0.0, 6.7, least=0.0),)

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        return replace(bench, pole=bench.pole + given["s"])


class CrossAxisSensitivity(Effect):
    """The accelerometer reads a share of the axial motion; data sheets allow 5 %."""

    id = "cross_axis_sensitivity"
    title = "cross-axis sensitivity of the accelerometer"
    mechanism = Mechanism.MEASURING_CHAIN
    law = "on the axis"
    own_parameters = (Parameter("sensitivity", "1", 0.0, 0.033),)

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        return replace(bench, cross_axis=bench.cross_axis + given["sensitivity"])


class CrossAxisAboveTheAxis(ElementAboveTheAxis, CrossAxisSensitivity):
    """`CrossAxisSensitivity` of an element above the beam's axis."""

    law = "above the axis"


class MainsHum(Effect):
    """The mains and its multiples on the accelerometer; ground loops make 0.01 to 0.1 m/s^2 with an unshielded cable.

    It shows in the records of blows, or in dips of coherence at single lines, and is found there before anything is
    fitted (`analysis.gap.faults.mains_detection`); those lines are then left out.
    """

    id = "mains_hum"
    title = "mains hum"
    mechanism = Mechanism.MEASURING_CHAIN
    law = "found in records"
    own_parameters = (Parameter("amplitude", "m/s^2", 0.0, 0.05, least=0.0),)


class SmoothChain(Effect):
    """Any smooth complex gain over frequency, common to all rows, and a share of the axial motion."""

    id = "measuring_chain"
    title = "another gain or phase of the measuring chain"
    mechanism = Mechanism.MEASURING_CHAIN
    law = "smooth curve"
    law_free = True
    own_parameters = (
        *OVER_BAND.parameters("gain", 0.03),
        *OVER_BAND.parameters("phase", 0.05),
        Parameter("leak", "1", 0.0, 0.033),
    )

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        gain, phase = (OVER_BAND.at(given, name, setting.frequency) for name in ("gain", "phase"))
        return replace(_scaled(bench, gain + 1j * phase), cross_axis=bench.cross_axis + given["leak"])
