"""Parameters of effects in words."""

import re
from collections.abc import Iterator
from dataclasses import replace

from analysis.gap.catalogue import laws
from analysis.gap.measurement import Measurement
from jointlab.diagnosis.parameter_words import OF_EFFECT, SHARED, parameter_words
from tests.analysis.gap.conftest import blank, drawn


def _parameters(measurement: Measurement) -> Iterator[tuple[str, str]]:
    """Every effect and parameter of the catalogue, of laws that may bend as well."""
    warm = replace(measurement, sets=tuple(replace(each, temperature=30.0) for each in measurement.sets))
    for seen in (measurement, warm):
        for law in laws():
            for effect in law.variants(seen):
                for each in filter(None, (effect, effect.bent(seen))):
                    yield from ((effect.id, parameter.name) for parameter in each.parameters)


def test_every_parameter_of_the_catalogue_has_words_and_keeps_its_name() -> None:
    """One without words would be shown by its name alone."""
    found = {pair: parameter_words(*pair) for pair in _parameters(blank(drawn()))}
    assert [pair for pair, words in found.items() if not words.endswith(f" ({pair[1]})")] == []
    assert [words for words in found.values() if "{" in words] == []


def test_no_words_stand_for_a_parameter_that_no_effect_has() -> None:
    """They would tell of what an earlier version had."""
    there = set(_parameters(blank(drawn())))
    own = [(effect, pattern) for effect, patterns in OF_EFFECT.items() for pattern in patterns]
    assert [
        pair for pair in own if not any(pair[0] == effect and re.fullmatch(pair[1], name) for effect, name in there)
    ] == []
    assert [pattern for pattern in SHARED if not any(re.fullmatch(pattern, name) for _, name in there)] == []


def test_words_name_the_joint_or_frequency_of_a_parameter() -> None:
    """Several parameters of an effect differ in nothing else."""
    assert (
        parameter_words("support_position", "dx_II")
        == "distance of joint II from its drawn place, positive to the right (dx_II)"
    )
    assert parameter_words("loss_law", "shear_8") == "logarithm of the ratio to the power at 8 Hz, shear (shear_8)"


def test_a_parameter_of_another_structure_is_shown_by_its_name() -> None:
    """Plug-ins name their own."""
    assert parameter_words("added_mass", "mass") == "mass"
