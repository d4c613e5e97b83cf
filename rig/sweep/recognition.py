"""Recognising planned sine points in records of a machine that its own software drives."""

from collections.abc import Sequence

import numpy as np

from analysis.direct.sine import SineFit, fit_sine, strongest_frequency
from analysis.errors import AnalysisError
from daq.block import Block
from rig.errors import RigError
from rig.sequences.sequence import DISPLACEMENT, FORCE
from rig.sequences.sweep_plan import Sine
from rig.sweep.amplitude import is_steady
from rig.sweep.driven_sweep import HARMONICS

FREQUENCY_WITHIN, AMPLITUDE_WITHIN, PRESET_WITHIN = 0.002, 0.1, 0.1
"""Largest relative differences of a point from the plan."""
ZERO_ERROR = 2e-5
"""Error of the zero of a displacement sensor in m: the mean may differ from any preset by as much."""
CYCLE_WITHIN = 0.15
"""Largest relative difference of the amplitude of one block of cycles from the mean of all."""
PHASE_WITHIN = 0.05
"""Largest standard deviation of the phase between blocks of cycles, rad."""
OTHER_WITHIN = 0.2
"""Largest motion at other frequencies, over that at the frequency of the point."""
LEAST_FORCE = 10.0
"""Smallest amplitude of the force, in standard errors from its noise."""


class NotAPointError(RigError):
    """A record shows no point that may be stored; the message says why."""


def motion_in(block: Block, least_pp: float) -> SineFit:
    """The strongest sine of the displacement, its frequency refined.

    Raises NotAPointError where there is none of `least_pp` m or more.
    """
    displacement = block.value(DISPLACEMENT)
    if DISPLACEMENT in block.overloaded:
        raise NotAPointError("the displacement channel is at an end of its range")
    if np.ptp(displacement) == 0:
        raise NotAPointError("the displacement channel gives one value alone; is it connected?")
    begin = strongest_frequency(displacement, block.sample_rate)
    try:
        fit = fit_sine(displacement, block.sample_rate, begin, harmonics=HARMONICS, names=(DISPLACEMENT,))
    except AnalysisError as error:
        raise NotAPointError("there is no steady sine") from error
    if fit.amplitude_pp[0] < least_pp:
        raise NotAPointError("nothing moves")
    return fit


def planned_as(fit: SineFit, sines: Sequence[Sine]) -> Sine | None:
    """The nearest of `sines` to a motion; None where it is none of them."""

    def distances(sine: Sine) -> tuple[float, float]:
        frequency = abs(fit.frequency / sine.driven_frequency - 1) / FREQUENCY_WITHIN
        return frequency, abs(float(fit.amplitude_pp[0]) / sine.amplitude_pp - 1) / AMPLITUDE_WITHIN

    near = [sine for sine in sines if max(distances(sine)) <= 1]
    return min(near, key=lambda sine: sum(distances(sine)), default=None)


def check_settled(fit: SineFit, tolerance: float) -> None:
    """Check that a motion is the same throughout its record, its amplitude to about a quarter of `tolerance`.

    Raises NotAPointError where it is not.
    """
    blocks = fit.blocks[:, 0, 0] / fit.first[0]
    if np.max(np.abs(np.abs(blocks) - 1)) > CYCLE_WITHIN or not is_steady(tuple(np.abs(blocks)[::-1]), tolerance):
        raise NotAPointError("its amplitude is not settled")
    if np.std(np.angle(blocks)) > PHASE_WITHIN:
        raise NotAPointError("its frequency is not settled")
    if fit.other_pp[0] > OTHER_WITHIN * fit.amplitude_pp[0]:
        raise NotAPointError(f"it moves by {1e3 * fit.other_pp[0]:.2g} mm at other frequencies, too")


def check_channels(block: Block, fit: SineFit, preset: float, *, is_specimen: bool) -> None:
    """Check what both channels say of a motion that was recognised: its mean, and that a specimen's force follows it.

    The force of a known piece is not compared with its motion: it may be zero, and it may lag.

    Raises NotAPointError where it may not be stored.
    """
    mean = float(np.mean(block.value(DISPLACEMENT)))
    if abs(mean - preset) > max(PRESET_WITHIN * abs(preset), ZERO_ERROR):
        raise NotAPointError(f"it moves about {1e3 * mean:.2g} mm, and {1e3 * preset:g} mm are planned")
    if FORCE in block.overloaded:
        raise NotAPointError("the force channel is at an end of its range")
    signals = np.stack([block.value(DISPLACEMENT), block.value(FORCE)])
    try:
        both = fit_sine(
            signals, block.sample_rate, fit.frequency, harmonics=HARMONICS, refine=False, names=(DISPLACEMENT, FORCE)
        )
    except AnalysisError as error:
        raise NotAPointError(str(error)) from error
    if not is_specimen:
        return
    if abs(both.first[1]) < LEAST_FORCE * both.residual_standard_error[1]:
        raise NotAPointError("no force follows the motion; is the force channel connected?")
    if (both.first[1] / both.first[0]).imag < 0:
        raise NotAPointError(
            "the force lags the displacement, and that of a specimen leads it: invert the polarity of the force or of "
            "the displacement channel"
        )
