"""The list of sequences: built-in and stored ones in one order, on both databases."""

from pathlib import Path

from jointlab.documents.runs import SequenceSummary
from jointlab.sequences import NAMES, built_in, list_sequences, save_sequence
from store.catalogue import Catalogue
from store.service.sequence_documents import save_sequence_document

STORED = ("Nightly", "a first one", "qualification", "zinc")


def test_built_in_sequences_are_in_the_list_in_the_order_of_names_on_every_page(
    database_url: str, tmp_path: Path
) -> None:
    with Catalogue.open(database_url, tmp_path / "waveforms") as catalogue, catalogue.writing() as session:
        for name in STORED:
            save_sequence(session, name, built_in("paper"))
        whole = list_sequences(session, after="", limit=100)
        assert {each.name for each in whole} == {*STORED, *NAMES}
        assert len(whole) == len(STORED) + len(NAMES)
        # a database may have its own order of capital letters; these are in one order everywhere
        assert [each.name for each in whole if each.name != "Nightly"] == [
            "a first one", "paper", "qualification", "suspended", "zinc",
        ]  # fmt: skip
        assert [each.name for each in whole if each.built_in] == ["paper", "suspended"]
        assert all((each.changed_at is None) == each.built_in for each in whole)
        paged: list[SequenceSummary] = []
        after = ""
        while page := list_sequences(session, after=after, limit=2):
            paged, after = [*paged, *page], page[-1].name
        assert paged == whole


def test_a_stored_sequence_with_a_built_in_name_is_hidden_by_it(database_url: str, tmp_path: Path) -> None:
    with Catalogue.open(database_url, tmp_path / "waveforms") as catalogue, catalogue.writing() as session:
        save_sequence_document(session, "suspended", {"title": "of a time before it was built in"})
        found = list_sequences(session, after="paper", limit=100)
        assert [(each.name, each.title, each.built_in) for each in found] == [
            ("suspended", built_in("suspended").title, True)
        ]
