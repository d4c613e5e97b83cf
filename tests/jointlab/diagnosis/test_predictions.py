"""before.unv and after.unv, read as somebody else's program would."""

from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from analysis.dof import Dof
from analysis.gap.diagnosis import Diagnosis
from jointlab.diagnosis.predictions import write_predictions
from jointlab.errors import JointlabError
from store.errors import StoreError
from store.exchange.accelerance_file import read_accelerances
from store.exchange.uff import UffModel, read_uff

ASKED = ((Dof.parse("3y"), Dof.parse("5y")),)
MODEL = UffModel("beam", (0.0, 0.1, 0.2, 0.3, 0.4), datetime(2026, 3, 1, tzinfo=UTC))


def test_predictions_are_read_back_as_they_were_written(diagnosis: Callable[..., Diagnosis], tmp_path: Path) -> None:
    predicted = diagnosis().predicted
    assert predicted is not None
    files = write_predictions(tmp_path / "new", predicted, ASKED, MODEL)
    assert [file.name for file in files] == ["before.unv", "after.unv"]
    for file, expected in zip(files, (predicted.before, predicted.after), strict=True):
        read = read_accelerances(file)
        assert (str(read.response), [str(dof) for dof in read.inputs]) == ("3y", ["5y"])
        np.testing.assert_array_equal(read.frequency, predicted.frequency)
        np.testing.assert_array_equal(read.accelerance, expected)
        assert [place[0] for place in read_uff(file).nodes.values()] == pytest.approx(MODEL.positions)


def test_what_has_no_place_is_refused(diagnosis: Callable[..., Diagnosis], tmp_path: Path) -> None:
    predicted = diagnosis().predicted
    assert predicted is not None
    (tmp_path / "file").write_text("")
    with pytest.raises(JointlabError, match="cannot be made"):
        write_predictions(tmp_path / "file", predicted, ASKED, MODEL)
    uneven = replace(predicted, frequency=np.array([5.0, 5.5, 7.0]))
    with pytest.raises(StoreError, match="evenly spaced"):
        write_predictions(tmp_path, uneven, ASKED, MODEL)
