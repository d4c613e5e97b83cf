"""Simulators and effects that others wrote: found by file, by module and in an installed package of their own."""

import json
import sys
from pathlib import Path

import pytest

from jointlab.errors import JointlabError
from jointlab.structures.plug_ins import curves_read, effect_named, offered_effects, simulator_named

EXAMPLES = Path(__file__).resolve().parents[3] / "docs" / "examples"


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder on the path, as of packages that pip installed."""
    monkeypatch.syspath_prepend(str(tmp_path))
    return tmp_path


def install(folder: Path, name: str, code: str, *entries: str) -> None:
    (folder / f"{name}.py").write_text(code, encoding="utf-8")
    metadata = folder / f"{name}-1.0.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n", encoding="utf-8")
    (metadata / "entry_points.txt").write_text("\n".join(entries), encoding="utf-8")


def test_examples_of_a_simulator_and_of_an_effect_are_short_and_load() -> None:
    for name in ("own_simulator.py", "own_effect.py"):
        assert len((EXAMPLES / name).read_text(encoding="utf-8").splitlines()) < 60
    assert simulator_named(f"{EXAMPLES / 'own_simulator.py'}:pendulum").name == "mass on a spring"
    assert effect_named(f"{EXAMPLES / 'own_effect.py'}:LoadStiffening").id == "load_stiffening"


def test_an_installed_package_offers_its_simulator_and_its_effects_by_name(installed: Path) -> None:
    code = "".join((EXAMPLES / name).read_text(encoding="utf-8") for name in ("own_simulator.py", "own_effect.py"))
    install(
        installed, "springs_of_ours", code,
        "[jointlab.gap.simulators]", "our_pendulum = springs_of_ours:pendulum",
        "[jointlab.gap.effects]", "load = springs_of_ours:LoadStiffening",
    )  # fmt: skip
    assert simulator_named("our_pendulum").name == "mass on a spring"
    found, failures = offered_effects()
    assert ([each.id for each in found], failures) == (["load_stiffening"], [])
    sys.modules.pop("springs_of_ours")


def test_a_package_that_cannot_be_imported_costs_its_effect_alone_and_is_named(installed: Path) -> None:
    install(installed, "broken_of_ours", "import no_such_thing", "[jointlab.gap.effects]", "loose = broken_of_ours:X")
    code = (EXAMPLES / "own_effect.py").read_text(encoding="utf-8")
    install(installed, "whole_of_ours", code, "[jointlab.gap.effects]", "load = whole_of_ours:LoadStiffening")
    found, (failure,) = offered_effects()
    assert [each.id for each in found] == ["load_stiffening"]
    assert failure.effect == "loose"
    assert "loose (broken_of_ours:X) cannot be imported" in failure.reason
    assert "no_such_thing" in failure.reason
    sys.modules.pop("whole_of_ours")


def test_a_simulator_that_two_packages_offer_by_one_name_is_refused_with_both(installed: Path) -> None:
    code = (EXAMPLES / "own_simulator.py").read_text(encoding="utf-8")
    for name in ("first_of_ours", "second_of_ours"):
        install(installed, name, code, "[jointlab.gap.simulators]", f"our_pendulum = {name}:pendulum")
    with pytest.raises(
        JointlabError, match=r"two packages offer the simulator our_pendulum: .*first.*second|second.*first"
    ):
        simulator_named("our_pendulum")


def test_a_file_that_ends_the_program_is_named(tmp_path: Path) -> None:
    (tmp_path / "licensed.py").write_text("raise SystemExit('no licence server')", encoding="utf-8")
    with pytest.raises(JointlabError, match=r"licensed.py cannot be run: SystemExit: no licence server"):
        simulator_named(f"{tmp_path / 'licensed.py'}:model")


@pytest.mark.parametrize(
    ("code", "said"),
    [
        ("def read(path): return open(path / 'x')", "NotADirectoryError|FileNotFoundError"),
        ("def read(path): return [1.0]", "finds no curves"),
        ("def read(path): return []", "finds no curves"),
    ],
)
def test_a_reader_that_fails_is_named(tmp_path: Path, code: str, said: str) -> None:
    (tmp_path / "reads.py").write_text(code, encoding="utf-8")
    with pytest.raises(JointlabError, match=rf"reads.py:read .*({said})"):
        curves_read(tmp_path / "data.csv", f"{tmp_path / 'reads.py'}:read")


def test_an_effect_that_cannot_be_made_is_named(tmp_path: Path) -> None:
    code = (EXAMPLES / "own_effect.py").read_text(
        encoding="utf-8"
    ) + "    def __init__(self): raise OSError('no licence')"
    (tmp_path / "unmade.py").write_text(code, encoding="utf-8")
    with pytest.raises(JointlabError, match="LoadStiffening cannot be made: OSError: no licence"):
        effect_named(f"{tmp_path / 'unmade.py'}:LoadStiffening")


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("pendulum", "names no simulator: write package.module:object"),
        ("no_such_package.at_all:x", "cannot be imported"),
        ("no_such_file.py:x", "there is no file"),
        ("math:nothing", "has no 'nothing'"),
        ("math:pi", "is no simulator: it lacks name"),
        ("analysis.gap.structures.single_degree:SingleDegree", "is a class, not a simulator; name an object"),
    ],
)
def test_a_name_that_leads_nowhere_is_refused_with_what_to_write(name: str, said: str) -> None:
    with pytest.raises(JointlabError, match=said):
        simulator_named(name)


def test_a_simulator_whose_parameters_are_none_is_refused_with_its_name(tmp_path: Path) -> None:
    code = (EXAMPLES / "own_simulator.py").read_text(encoding="utf-8")
    (tmp_path / "bad.py").write_text(f"{code}\nbad = CallableSimulator(natural_frequency, ('k',))\n", encoding="utf-8")
    with pytest.raises(JointlabError, match=r"bad\.py:bad is no simulator: a parameter of simulator callable is 'k'"):
        simulator_named(f"{tmp_path / 'bad.py'}:bad")


def test_an_effect_that_needs_one_name_in_place_of_a_set_is_refused_by_name_and_if_installed_costs_itself(
    installed: Path,
) -> None:
    code = (EXAMPLES / "own_effect.py").read_text(encoding="utf-8")
    bad = f"{code}\nclass OneName(LoadStiffening):\n    needs = 'load'\n"
    entries = ("[jointlab.gap.effects]", "bad = one_name_of_ours:OneName", "load = one_name_of_ours:LoadStiffening")
    install(installed, "one_name_of_ours", bad, *entries)
    with pytest.raises(JointlabError, match="the effect one_name_of_ours:OneName: needs is 'load'"):
        effect_named("one_name_of_ours:OneName")
    (found,), (failure,) = offered_effects()
    assert found.id == "load_stiffening"
    assert (failure.effect, "needs is 'load'" in failure.reason) == ("bad", True)
    sys.modules.pop("one_name_of_ours")


def test_what_is_no_effect_is_refused() -> None:
    with pytest.raises(JointlabError, match="make it a subclass"):
        effect_named("math:pi")


def test_a_file_that_is_named_like_a_module_leaves_that_module_as_it_is(tmp_path: Path) -> None:
    (tmp_path / "json.py").write_text((EXAMPLES / "own_simulator.py").read_text(encoding="utf-8"), encoding="utf-8")
    before = sys.modules["json"]
    assert simulator_named(f"{tmp_path / 'json.py'}:pendulum").name == "mass on a spring"
    assert sys.modules["json"] is before is json


def test_a_file_with_an_error_is_told_with_its_error(tmp_path: Path) -> None:
    (tmp_path / "wrong.py").write_text("1 / 0", encoding="utf-8")
    with pytest.raises(JointlabError, match="ZeroDivisionError"):
        simulator_named(f"{tmp_path / 'wrong.py'}:x")
