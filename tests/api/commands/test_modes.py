"""`jointlab modes`: quality, a band, and files of other programs: several accelerometers, roving ones, receptance."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from store.dof import StoredDof
from store.exchange.accelerance_file import accelerance_functions
from store.exchange.uff import write_uff
from store.states import SINE
from tests.api.conftest import Command
from tests.bench.bench_damped import LINES, draw

FREQUENCY = np.arange(0, 400.5, 0.5)
POINTS = tuple(StoredDof(node, "y") for node in (1, 3, 5, 7))
SHAPES = np.array([[1.0, 0.4, -0.5, -1.2], [1.1, -0.8, -0.6, 0.9]])  # (modes, points)
MODES = (90.0, 230.0)
DRAWN = draw(4)


def accelerance(response: int) -> NDArray[np.complex128]:
    """(points, lines) of two structurally damped modes, with a little noise."""
    noise = np.random.default_rng(response).normal(size=(2, len(POINTS), FREQUENCY.size))
    poles = [
        -(FREQUENCY**2)
        / (f**2 * (1 + 0.02j) - FREQUENCY**2)
        * np.outer(shape * shape[response], np.ones(FREQUENCY.size))
        for f, shape in zip(MODES, SHAPES, strict=True)
    ]
    return np.asarray(sum(poles) + 1e-3 * (noise[0] + 1j * noise[1]), dtype=np.complex128)


@pytest.fixture
def two_accelerometers(tmp_path: Path) -> Path:
    path = tmp_path / "two.unv"
    functions = [
        each for at in (0, 2) for each in accelerance_functions(POINTS[at], POINTS, FREQUENCY, accelerance(at))
    ]
    write_uff(path, functions)
    return path


def test_each_accelerometer_has_its_modes(jointlab: Command, two_accelerometers: Path) -> None:
    answer = jointlab("modes", two_accelerometers, "--json")
    assert (answer.returncode, answer.stderr) == (0, "")
    found = json.loads(answer.stdout)
    assert [each["accelerometer"] for each in found] == ["1y", "5y"]
    for each in found:
        assert each["frequency_hz"] == pytest.approx(MODES, rel=1e-3)
        assert each["points"] == ["1y", "3y", "5y", "7y"]
    table = jointlab("modes", two_accelerometers).stdout
    assert "accelerometer at 1y" in table
    assert "accelerometer at 5y" in table


def test_one_accelerometer_is_chosen_or_refused_by_name(jointlab: Command, two_accelerometers: Path) -> None:
    found = json.loads(jointlab("modes", two_accelerometers, "--accelerometer", "5y", "--json").stdout)
    assert found["accelerometer"] == "5y"
    answer = jointlab("modes", two_accelerometers, "--accelerometer", "3y")
    assert answer.returncode == 3
    assert answer.stderr == "jointlab: two.unv has no accelerometer at 3y; it has 1y, 5y\n"


def test_receptance_of_a_roving_accelerometer_has_the_same_modes(jointlab: Command, tmp_path: Path) -> None:
    receptance = accelerance(0)[:, 1:] / (2j * np.pi * FREQUENCY[1:]) ** 2
    functions = accelerance_functions(POINTS[0], POINTS, FREQUENCY[1:], receptance, excitation=SINE)
    write_uff(tmp_path / "a.unv", [replace(each, unit="m", quantity=8) for each in functions])
    answer = jointlab("modes", tmp_path / "a.unv", "--json")
    assert json.loads(answer.stdout)["frequency_hz"] == pytest.approx(MODES, rel=1e-3)
    assert answer.stderr.splitlines() == [
        "note: a.unv: the accelerometer roves; by reciprocity it is taken to be where the force is",
        "note: a.unv: receptance is converted to accelerance",
    ]


@pytest.fixture
def holder(tmp_path: Path) -> Path:
    points = [StoredDof(node, "y") for node in range(1, len(DRAWN.accelerance) + 1)]
    path = tmp_path / "holder.unv"
    write_uff(path, accelerance_functions(points[0], points, LINES, DRAWN.accelerance), binary=False)
    return path


def test_the_table_says_how_well_the_modes_fit(jointlab: Command, holder: Path) -> None:
    answer = jointlab("modes", holder)
    caption, _, *rows = answer.stdout.splitlines()
    assert caption.startswith("Modes, which explain 9")
    assert caption.endswith(" times the noise:")
    assert len(rows) == DRAWN.frequency.size


def test_a_band_gives_the_modes_in_it_and_the_quality_of_its_fit(jointlab: Command, holder: Path) -> None:
    middle = float(np.mean(DRAWN.frequency[1:3]))
    found = json.loads(jointlab("modes", holder, "--band", 100, middle, "--json").stdout)
    assert found["frequency_hz"] == pytest.approx(DRAWN.frequency[:2], rel=0.01)
    assert 0.99 < found["fit"]["explained"] < 1
    assert found["fit"]["residual_over_noise"] == pytest.approx(1, abs=0.2)


def test_an_accelerometer_without_a_mode_does_not_hide_the_others(jointlab: Command, tmp_path: Path) -> None:
    noise = np.random.default_rng(1).normal(size=(2, len(POINTS), FREQUENCY.size))
    silent = noise[0] + 1j * noise[1]
    functions = [
        each
        for at, rows in ((0, accelerance(0)), (2, silent))
        for each in accelerance_functions(POINTS[at], POINTS, FREQUENCY, rows)
    ]
    write_uff(tmp_path / "a.unv", functions)
    answer = jointlab("modes", tmp_path / "a.unv", "--json")
    (found,) = json.loads(answer.stdout)
    assert (found["accelerometer"], answer.returncode) == ("1y", 0)
    assert answer.stderr.startswith("note: accelerometer at 5y: no mode ")
    alone = jointlab("modes", tmp_path / "a.unv", "--accelerometer", "5y")
    assert (alone.returncode, alone.stdout) == (3, "")
    assert alone.stderr.startswith("jointlab: no mode ")


def test_each_level_of_an_export_has_its_modes(jointlab: Command, tmp_path: Path) -> None:
    """A file of several levels has a set for each, of which the last one alone was shown."""
    path, level = tmp_path / "levels.unv", accelerance_functions(POINTS[0], POINTS, FREQUENCY, accelerance(0))
    write_uff(path, [*level, *level])
    found = json.loads(jointlab("modes", path, "--json").stdout)
    assert [each["accelerometer"] for each in found] == ["1y, set 1", "1y, set 2"]
