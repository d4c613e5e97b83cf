"""Halves of surrogate pairs: found and replaced wherever they are in a document."""

from enum import StrEnum

from store.text import changed, contains_half, without_halves


class Kind(StrEnum):
    HAMMER = "hammer"


def test_a_half_is_found_and_replaced_in_keys_and_values_and_whole_pairs_stay() -> None:
    document = {
        "a\ud800": ["\udfff", {"b": "\ud83d\ude00".encode("utf-16", "surrogatepass").decode("utf-16")}],
        "c": 1.5,
    }
    assert contains_half(document)
    replaced = changed(document, without_halves)
    assert replaced == {"a\ufffd": ["\ufffd", {"b": "\N{GRINNING FACE}"}], "c": 1.5}
    assert not contains_half(replaced)


def test_what_has_no_half_is_the_same_object() -> None:
    assert without_halves(Kind.HAMMER) is Kind.HAMMER
    assert without_halves(None) is None
