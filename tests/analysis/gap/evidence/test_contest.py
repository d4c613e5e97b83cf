"""Models of the same data are compared under one overdispersion."""

from dataclasses import replace

import pytest

from analysis.gap.effects.joint_geometry import VerticalOffset
from analysis.gap.effects.measuring_chain import ExponentialWindow
from analysis.gap.evidence.calibration import UNCALIBRATED
from analysis.gap.evidence.contest import Contest
from analysis.gap.fitting.model import Model
from tests.analysis.gap.evidence.stated_models import Stated, model


def with_common_noise(found: Model, lines: float) -> Stated:
    assert isinstance(found, Stated)
    return replace(found, common_noise=lines)


def test_noise_that_lines_have_in_common_counts_once_for_all_models() -> None:
    none, window = model((), 1e6 + 1000, 1e6), model((ExponentialWindow(),), 1000.0)
    pair = model((ExponentialWindow(), VerticalOffset(("I", "II"))), 996.0)
    assert Contest(none, [window, pair], UNCALIBRATED).overdispersion == 1.0
    contest = Contest(none, [with_common_noise(each, 8.4) for each in (window, pair)], UNCALIBRATED)
    assert contest.overdispersion == pytest.approx(8.4)
