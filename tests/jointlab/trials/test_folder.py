"""Seals: committed to first, opened on an answer, and refused when they were changed."""

import hashlib
import json
from pathlib import Path

import numpy as np
import pytest

from jointlab.errors import JointlabError
from jointlab.trials.folder import TrialFolder, read, write
from jointlab.trials.plan import plan

SETTINGS = {"cases": 1, "seed": 1}


@pytest.fixture
def folder(tmp_path: Path) -> TrialFolder:
    made = TrialFolder(tmp_path / "trial")
    made.begin(SETTINGS)
    return made


CASE = plan(1, 1)[0]


def test_a_commitment_is_the_hash_of_nonce_and_truth_and_tells_neither(folder: TrialFolder) -> None:
    committed = folder.seal(CASE)
    seal = read(folder.path / "sealed" / "0001.json")
    text = json.dumps(seal, sort_keys=True, separators=(",", ":"))
    assert committed == hashlib.sha256(text.encode()).hexdigest()
    assert seal["truth"]["effects"] == list(CASE.effects)
    assert len(seal["nonce"]) == 32
    # the same case sealed elsewhere has another commitment: nobody finds a truth by trying all there are
    other = TrialFolder(folder.path / "other")
    other.begin(SETTINGS)
    assert other.seal(CASE) != committed
    assert folder.seal(CASE) == committed


def test_a_seal_opens_on_an_answer_only(folder: TrialFolder) -> None:
    folder.commit({CASE.name: folder.seal(CASE)})
    with pytest.raises(JointlabError, match="has not been answered"):
        folder.open(CASE)
    folder.keep(CASE, {"seconds": 1.0})
    assert folder.open(CASE)["seed"] == CASE.seed


def test_a_truth_that_was_changed_is_refused(folder: TrialFolder) -> None:
    folder.commit({CASE.name: folder.seal(CASE)})
    folder.keep(CASE, {"seconds": 1.0})
    file = folder.path / "sealed" / "0001.json"
    seal = read(file)
    seal["truth"]["effects"] = ["joint_mass"]
    write(file, seal)
    with pytest.raises(JointlabError, match="its truth was changed"):
        folder.open(CASE)


def test_another_trial_is_not_mixed_in(folder: TrialFolder) -> None:
    folder.begin(SETTINGS)
    with pytest.raises(JointlabError, match="holds another trial"):
        folder.begin(SETTINGS | {"seed": 2})


def test_an_answer_comes_back_with_what_was_predicted_and_fitted(folder: TrialFolder) -> None:
    predicted = {"after": np.array([[1 + 2j]]), "input": ["5y"]}
    folder.keep(CASE, {"seconds": 1.0, "predicted": predicted, "fitted": {"set": np.array([0, 1])}})
    found = folder.answer(CASE)
    assert found is not None
    assert found["seconds"] == 1.0
    np.testing.assert_array_equal(found["predicted"]["after"], [[1 + 2j]])
    np.testing.assert_array_equal(found["fitted"]["set"], [0, 1])
