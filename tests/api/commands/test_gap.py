"""`jointlab gap` on a bundle and a run, and what it says of wrong input."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np
import pytest

from analysis.gap.catalogue import effect_ids
from store.exchange.accelerance_file import read_accelerances
from tests.api.conftest import Command
from tests.elsewhere import read_elsewhere
from tests.investigations import small

EVERY = 32
"""Lines, of which one is kept: joints are identified from them, too."""
OTHERS = [f"--without={each}" for each in effect_ids() if each not in ("channel_delay", "joint_mass", "youngs_modulus")]
"""All but a part of the catalogue, which is quick; investigations of the same bench try all of it."""


@pytest.fixture(scope="module")
def bundle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A sealed case with a clear effect in the measuring chain, and few lines."""
    return small(5, tmp_path_factory.mktemp("case") / "bundle", EVERY)


@pytest.mark.usefixtures("terminal")
def test_a_run_is_diagnosed_predicted_reported_and_stored(
    jointlab: Command, bundle: Path, query: Callable[[str], list[tuple[Any, ...]]], tmp_path: Path
) -> None:
    assert jointlab("import", bundle).returncode == 0
    wanted = ("--json", "gap.json", "--predictions", "predicted", "-o", "gap.html", "--model-out", "model.h5")
    answer = jointlab("gap", "diagnose", 1, *OTHERS, *wanted)
    assert answer.returncode == 0, answer.stderr
    told = "first answer, not final: delay between the channels (channel_delay), explains"
    assert told in answer.stderr
    assert "not final" not in answer.stderr.split("100/100")[-1]
    assert "not final" not in answer.stdout
    assert "EXPLAINED: add" in answer.stdout
    assert "(channel_delay): the gap falls from" in answer.stdout
    text = (tmp_path / "gap.json").read_text(encoding="utf-8")
    assert "not final" not in text
    document = json.loads(text)
    assert document["format"] == "jointlab-diagnosis/1"
    assert document["verdict"]["effects"] == ["channel_delay"]
    asked = json.loads((bundle / "setup.json").read_text(encoding="utf-8"))["predict"]
    for name in ("before.unv", "after.unv"):
        read = read_accelerances(tmp_path / "predicted" / name)
        assert [[dof.node, dof.direction] for dof in read.inputs] == [each["input"] for each in asked]
    assert "channel_delay" in (tmp_path / "gap.html").read_text(encoding="utf-8")
    stored = query("SELECT status, effects, document FROM diagnoses")
    assert [(status, json.loads(effects)) for status, effects, _ in stored] == [("explained", ["channel_delay"])]
    assert json.loads(stored[0][2]) == document
    # the corrected simulation predicts the same, without any of our code; so does that of the stored diagnosis
    expected = read_accelerances(tmp_path / "predicted" / "after.unv")
    inputs = map(str, read_accelerances(tmp_path / "model.unv").inputs)
    rows = read_elsewhere(tmp_path / "model.h5")
    by_input = dict(zip(inputs, rows, strict=True))
    for dof, row in zip(expected.inputs, expected.accelerance, strict=True):
        np.testing.assert_allclose(by_input[str(dof)], row, rtol=1e-6)
    effect = json.loads((tmp_path / "model.json").read_text(encoding="utf-8"))["model"]["effects"][0]
    assert (effect["id"], effect["parameters"]["tau"]["unit"]) == ("channel_delay", "s")
    assert jointlab("export", 1, "model.zip", "--format", "model").returncode == 0
    with ZipFile(tmp_path / "model.zip") as archive:
        archive.extractall(tmp_path / "stored")
    np.testing.assert_allclose(read_elsewhere(tmp_path / "stored" / "model.h5"), rows, rtol=1e-9)
    # its effect lowers the gap of another article, too
    other = small(6, tmp_path / "other", EVERY)
    answer = jointlab("gap", "diagnose", other, "--with-effect", "model.json", "--json", "carried.json")
    assert answer.returncode == 0, answer.stderr
    assert "channel_delay of the other article lowers the gap on held-out data" in answer.stdout
    gap = json.loads((tmp_path / "carried.json").read_text(encoding="utf-8"))["gap"]
    assert gap["after"]["percent"] < 1.2 * gap["floor_percent"] < gap["before"]["percent"]
    # and the run's report has it
    assert jointlab("report", 1).returncode == 0
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert 'aria-label="Gap before and after"' in page
    assert 'aria-label="Fig. 11' in page


def test_where_alone_is_said_without_a_cause(jointlab: Command, bundle: Path, tmp_path: Path) -> None:
    answer = jointlab("gap", "locate", bundle, "--json", "where.json")
    assert answer.returncode == 0, answer.stderr
    assert "beam rig, blow at" in answer.stdout
    assert "not why" in answer.stdout
    assert "channel_delay" not in answer.stdout
    found = json.loads((tmp_path / "where.json").read_text(encoding="utf-8"))
    assert found["where"][0]["part"] == "phase"
    assert not (tmp_path / "jointlab.db").exists()


def test_the_catalogue_lists_every_effect_with_laws_and_ranges(jointlab: Command, bundle: Path) -> None:
    answer = jointlab("gap", "catalogue")
    assert answer.returncode == 0
    for effect in effect_ids():
        assert effect in answer.stdout, effect
    assert jointlab("gap", "catalogue", bundle).returncode == 0


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("diagnose", "nowhere"), "there is no bundle nowhere"),
        (("diagnose", "7"), "run 7"),
        (("locate", "nowhere"), "there is no bundle nowhere"),
    ],
)
def test_what_is_not_there_is_said(jointlab: Command, arguments: tuple[str, ...], said: str) -> None:
    answer = jointlab("gap", *arguments)
    assert answer.returncode == 3
    assert said in answer.stderr


def test_an_effect_of_another_article_goes_with_no_search(jointlab: Command, bundle: Path, tmp_path: Path) -> None:
    (tmp_path / "model.json").write_text('{"format": "jointlab-diagnosis/1"}', encoding="utf-8")
    for more, said in ((("--without", "density"), "makes no search"), ((), "model.json is no corrected simulation")):
        answer = jointlab("gap", "diagnose", bundle, "--with-effect", "model.json", *more)
        assert answer.returncode == 3
        assert said in answer.stderr


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("trial", "--model", "bridge.py:bridge"), "--model and --on belong together"),
        (("trial", "--seal", "trial", "--on", "curves.csv"), "--model and --on belong together"),
        (("trial", "--model", "a:b", "--on", "curves.csv", "--plain"), "belong to a trial of the beam rig"),
        (("trial", "--model", "a:b", "--on", "curves.csv", "--workers", "4"), "belong to a trial of the beam rig"),
        (("trial", "--seal", "trial", "--effect", "a:b"), "--reader and --effect to them"),
        (("diagnose", "curves.csv", "--model", "a:b", "--report", "gap.html"), "belong to the beam rig"),
        (("diagnose", "bundle", "--with-effect", "model.json", "--model", "a:b"), "makes no search"),
    ],
)
def test_options_that_would_do_nothing_are_refused(jointlab: Command, arguments: tuple[str, ...], said: str) -> None:
    answer = jointlab("gap", *arguments)
    assert answer.returncode == 3
    assert said in " ".join(answer.stderr.split())


def test_predictions_that_nobody_asked_for_are_refused_before_the_diagnosis(
    jointlab: Command, bundle: Path, tmp_path: Path
) -> None:
    plain = Path(shutil.copytree(bundle, tmp_path / "plain"))
    setup = json.loads((plain / "setup.json").read_text(encoding="utf-8"))
    (plain / "setup.json").write_text(json.dumps({**setup, "predict": []}), encoding="utf-8")
    answer = jointlab("gap", "diagnose", plain, "--predictions", tmp_path / "predicted.unv")
    assert answer.returncode == 3
    assert "asks for no predictions" in " ".join(answer.stderr.split())


def test_an_unknown_effect_is_refused_with_those_that_are_known(jointlab: Command, bundle: Path) -> None:
    answer = jointlab("gap", "diagnose", bundle, "--without", "gravity")
    assert answer.returncode == 3
    assert "no effect 'gravity'" in answer.stderr
    assert "channel_delay" in answer.stderr
