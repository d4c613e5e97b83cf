"""Tables write the loss factor with one sign, and runs in one way."""

import ast
from pathlib import Path

import pytest

import jointlab.report
from jointlab.documents.master import PredictionDocument, runs_text
from jointlab.report.master import predictions_table

SIGN, WORD = "γ", "gamma"
MODULES = sorted(Path(jointlab.report.__path__[0]).glob("*.py"))


def prediction() -> PredictionDocument:
    """A prediction of a master curve."""
    return PredictionDocument(
        frequency=1000.0,
        temperature_c=23.0,
        reduced_frequency=1000.0,
        k=1e6,
        k_ci95=(0.9e6, 1.1e6),
        gamma=0.2,
        gamma_ci95=(0.1, 0.3),
        beyond=[],
    )


def test_predictions_of_a_master_curve_have_the_sign_of_other_tables() -> None:
    assert SIGN in predictions_table([prediction()]).head
    assert WORD not in predictions_table([prediction()]).head


@pytest.mark.parametrize("module", MODULES, ids=lambda path: path.stem)
def test_no_head_of_a_table_has_the_word(module: Path) -> None:
    heads = [
        node
        for node in ast.walk(ast.parse(module.read_text(encoding="utf-8")))
        if isinstance(node, ast.Tuple) and sum(isinstance(each, ast.Constant) for each in node.elts) > 3
    ]
    texts = [each.value for node in heads for each in node.elts if isinstance(each, ast.Constant)]
    assert not [text for text in texts if isinstance(text, str) and text.startswith(WORD)]


def test_runs_are_counted_in_words() -> None:
    assert [runs_text([3]), runs_text([3, 4])] == ["run 3", "runs 3, 4"]
