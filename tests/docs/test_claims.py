"""What pages state of routes, limits, times, scopes, configuration and sequences is what the program has."""

import json
import re
import tomllib
from pathlib import Path
from typing import Any, get_args

import pytest
import yaml

from jointlab.jobs.kinds import HOUR, KINDS
from jointlab.settings import Settings
from rig.sequences.sequence import Step, sequence_from
from rig.tester.limits import HARD_CAPS, TesterLimits
from store.states import Scope

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
PAGES = sorted([ROOT / "README.md", *DOCS.glob("*.md")])
ROUTE = re.compile(r"(?:(GET|POST|PUT|DELETE) )?(?<![\w/])(/api(?:/[\w{}-]+)*(?:\.csv)?)(?![\w.])")
JOBS = {
    "diagnosis": "diagnose", "step of an investigation": "investigate", "identification": "identify",
    "master curve": "master", "export": "export", "trial": "trial",
}  # fmt: skip


def page(name: str) -> str:
    return (DOCS / name).read_text(encoding="utf-8")


def row(text: str, first: str) -> list[str]:
    """The cells of the line of a table that begins with `first`."""
    (line,) = re.findall(rf"^\| {re.escape(first)} \|.*$", text, re.MULTILINE)
    return [cell.strip() for cell in str(line).strip("|").split("|")]


def blocks(text: str, language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.MULTILINE | re.DOTALL)


def without_values(path: str) -> str:
    """A route without names or numbers in the places of its parameters."""
    return re.sub(r"\{\w+\}\.\{\w+\}|\w+\.csv|\{\w+\}|(?<=/)\d+", "*", path)


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.name)
def test_routes_exist(path: Path) -> None:
    schema: dict[str, Any] = json.loads((ROOT / "tests/api/service/openapi.json").read_text(encoding="utf-8"))["paths"]
    known = {without_values(route): {each.upper() for each in operations} for route, operations in schema.items()}
    known["/api"] = set()
    named = ROUTE.findall(path.read_text(encoding="utf-8"))
    missing = [(method, route) for method, route in named if without_values(route) not in known]
    missing += [
        (method, route) for method, route in named if method and method not in known.get(without_values(route), method)
    ]
    assert not missing


def test_security_names_the_longest_time_of_every_kind_of_job() -> None:
    _, stated, _ = row(page("security.md"), "time of a job")
    found, waiting = dict[str, float](), list[str]()
    for part in re.split(r", | and ", stated):
        fitting = re.fullmatch(r"(.*?)(?: (\d+) h)?", part)
        assert fitting is not None, part
        name, hours = fitting.groups()
        waiting.append(JOBS[name])
        if hours is not None:
            found |= dict.fromkeys(waiting, float(hours) * HOUR)
            waiting.clear()
    assert found == {name: kind.time_limit for name, kind in KINDS.items()}


def test_service_names_every_scope() -> None:
    (table,) = re.findall(r"^\| scope \| opens \|\n\|---\|---\|\n((?:\|.*\n)+)", page("service.md"), re.MULTILINE)
    assert set(re.findall(r"^\| `([\w:]+)` \|", table, re.MULTILINE)) == {each.value for each in Scope}


@pytest.mark.parametrize(
    ("name", "lowest", "highest", "scale"),
    [
        ("peak-to-peak amplitude", None, "amplitude_pp", 1e3),
        ("frequency", "lowest_frequency", "highest_frequency", 1.0),
        ("preset", "lowest_preset", "highest_preset", 1e3),
        ("velocity of a cycle", None, "velocity", 1.0),
        ("acceleration of a cycle", None, "acceleration", 1.0),
        ("force", None, "force", 1e-3),
    ],
)
def test_safety_has_the_limits_of_the_rig(name: str, lowest: str | None, highest: str, scale: float) -> None:
    _, default, cap, _ = row(page("safety.md"), name)
    limits = TesterLimits()
    values = [getattr(limits, each) * scale for each in (lowest, highest) if each is not None]
    assert [float(each) for each in re.findall(r"(?<!\w)-?[\d.]+", default)] == pytest.approx(values)
    ends = [end * scale for end in HARD_CAPS[highest]]
    assert [float(each) for each in re.findall(r"(?<!\w)-?[\d.]+", cap)] == pytest.approx(ends if ends[0] else ends[1:])


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.name)
def test_examples_of_the_configuration_are_settings(path: Path) -> None:
    for block in blocks(path.read_text(encoding="utf-8"), "toml"):
        given = tomllib.loads(block)
        if "project" not in given:  # of a plug-in's own package
            Settings(**given)


def test_examples_of_a_sequence_are_one() -> None:
    document, tighter, compound = map(yaml.safe_load, blocks(page("sequences.md"), "yaml"))
    document["steps"][-1] |= tighter
    sequence = sequence_from(document | compound)
    assert sequence.sweep is not None
    assert sequence.sweep.detectors is not None
    assert sequence.compound is not None


def test_every_step_and_field_of_a_sequence_is_explained() -> None:
    kinds = get_args(get_args(Step)[0])
    named = set(re.findall(r"`(\w+)[`:]", page("sequences.md")))
    fields = {name for kind in kinds for name in kind.model_fields if name != "step"}
    assert fields - named == set()
    assert {get_args(kind.model_fields["step"].annotation)[0] for kind in kinds} - named == set()
