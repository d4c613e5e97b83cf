"""Sequences as YAML text: a built-in one as it was written, any other one so that it can be read back."""

from pathlib import Path

import pytest

from jointlab.errors import ConflictError
from jointlab.sequences import NAMES, built_in, save_sequence, sequence_named, text_of
from rig.sequences.sequence import SequenceError
from rig.sequences.sequence_file import sequence_of_text
from store.catalogue import Catalogue
from store.service.sequence_documents import save_sequence_document


@pytest.mark.parametrize("name", NAMES)
def test_the_text_of_a_sequence_describes_the_same_one_before_and_after_it_was_kept(name: str, tmp_path: Path) -> None:
    with Catalogue.open(f"sqlite:///{tmp_path / 'lab.db'}") as catalogue, catalogue.writing() as session:
        written = text_of(session, name)
        assert sequence_of_text(written, "the text") == built_in(name)
        save_sequence(session, "mine", built_in(name))
        assert sequence_of_text(text_of(session, "mine"), "the text") == built_in(name)
        assert sequence_named(session, "mine") == built_in(name)


def test_a_stored_document_that_is_no_sequence_any_more_can_still_be_edited(tmp_path: Path) -> None:
    with Catalogue.open(f"sqlite:///{tmp_path / 'lab.db'}") as catalogue, catalogue.writing() as session:
        save_sequence_document(session, "old", {"format": "jointlab-sequence/1", "title": "Old", "steps": []})
        text = text_of(session, "old")
        with pytest.raises(SequenceError, match="line 3, steps: has 0 values"):
            sequence_of_text(text, "the text")


def test_a_built_in_sequence_is_not_replaced(tmp_path: Path) -> None:
    with (
        Catalogue.open(f"sqlite:///{tmp_path / 'lab.db'}") as catalogue,
        catalogue.writing() as session,
        pytest.raises(ConflictError, match="paper is built in"),
    ):
        save_sequence(session, "paper", built_in("paper"))
