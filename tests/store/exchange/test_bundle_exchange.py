"""Bundles go into the catalogue and come out equal, value by value, or not at all."""

import hashlib
import json
from collections.abc import Callable
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from sqlalchemy import text

from store.catalogue import Catalogue
from store.dof import StoredDof
from store.errors import DamagedError, NotFoundError, StoreError
from store.exchange.accelerance_file import accelerance_functions, read_accelerances
from store.exchange.bundle import read_bundle
from store.exchange.bundle_exchange import export_bundle, import_bundle
from store.exchange.uff import read_uff, write_uff
from store.measurements.blows import add_blow, add_point
from store.measurements.runs import get_run, list_runs, start_run
from store.results.analyses import add_analysis
from store.results.dynamic_stiffness import add_dynamic_stiffness
from store.states import SINE, RunState
from tests.recordings import Recording

Counts = Callable[[], dict[str, int]]
EXAMPLES = (
    "amplitude", "delay", "foundation", "frame", "none", "novel_1", "novel_2", "out_of_plane", "pair", "sensor_mass"
)  # fmt: skip


def assert_equal(found: Any, expected: Any, at: str = "bundle") -> None:
    """Equal to the last bit, through dataclasses, tuples and arrays."""
    assert type(found) is type(expected), at
    if is_dataclass(expected):
        for field in fields(expected):
            assert_equal(getattr(found, field.name), getattr(expected, field.name), f"{at}.{field.name}")
    elif isinstance(expected, tuple):
        assert len(found) == len(expected), at
        for index, (one, other) in enumerate(zip(found, expected, strict=True)):
            assert_equal(one, other, f"{at}[{index}]")
    elif isinstance(expected, np.ndarray):
        np.testing.assert_array_equal(found, expected, at)
        assert found.dtype == expected.dtype, at
    else:
        assert found == expected, at


@pytest.mark.parametrize("name", EXAMPLES)
def test_every_example_comes_out_as_it_went_in(
    catalogue: Catalogue, recording: Recording, tmp_path: Path, name: str
) -> None:
    original = read_bundle(recording(f"examples/{name}"))
    run_id = import_bundle(catalogue, recording(f"examples/{name}"))
    export_bundle(catalogue, run_id, tmp_path / "out")
    assert_equal(read_bundle(tmp_path / "out"), original)


def test_a_bundle_goes_through_a_zip(catalogue: Catalogue, bundle: Path, tmp_path: Path) -> None:
    export_bundle(catalogue, import_bundle(catalogue, bundle), tmp_path / "out.zip")
    assert_equal(read_bundle(tmp_path / "out.zip"), read_bundle(bundle))


def test_sets_of_hammer_and_shaker_go_side_by_side(catalogue: Catalogue, bundle: Path, tmp_path: Path) -> None:
    setup = json.loads((bundle / "setup.json").read_text(encoding="utf-8"))
    (struck,) = setup["inverse"]
    assert "excitation" not in struck  # the exchange format does not know it
    measured = read_accelerances(bundle / struck["file"])
    shaken = accelerance_functions(
        StoredDof(4, "y"), measured.inputs, measured.frequency, 2 * measured.accelerance, excitation=SINE
    )
    write_uff(bundle / "shaken.unv", shaken)
    setup["inverse"].append(struck | {"file": "shaken.unv", "excitation": "sine", "peak_force": 0.1})
    (bundle / "setup.json").write_text(json.dumps(setup), encoding="utf-8")
    original = read_bundle(bundle)
    expected = [("hammer", StoredDof(3, "y")), ("sine", StoredDof(4, "y"))]
    assert [(each.excitation, each.response) for each in original.inverse] == expected
    export_bundle(catalogue, import_bundle(catalogue, bundle), tmp_path / "out")
    assert_equal(read_bundle(tmp_path / "out"), original)


def test_an_import_is_one_finished_run(catalogue: Catalogue, bundle: Path) -> None:
    run_id = import_bundle(catalogue, bundle, article="beam 3")
    with catalogue.reading() as session:
        run = get_run(session, run_id)
        blows = session.execute(text("SELECT point, number, source FROM v_blows ORDER BY blow_id")).all()
    assert (run.kind, run.state, run.article, run.title) == (
        "import", RunState.FINISHED, "beam 3", "beam 3, roving hammer"
    )  # fmt: skip
    assert blows[1] == ("1y", 2, "blow_1y_set1_03.unv")
    assert [path.name for path in catalogue.waveforms.folder.iterdir()] == [run.waveform_file]


def test_the_peak_of_a_blow_in_the_negative_direction_is_positive(catalogue: Catalogue, bundle: Path) -> None:
    """As along positive directions its force is negative from begin to end."""
    file = bundle / "blows" / "blow_1y_set1_01.unv"
    _, *others = _peaks(catalogue, import_bundle(catalogue, bundle))
    force, acceleration = read_uff(file).functions
    down = replace(force.response, sign=-1)
    pulse = 100.0 * np.sin(np.linspace(0.0, np.pi, force.values.size))
    write_uff(file, [replace(force, response=down, values=pulse), replace(acceleration, reference=down)])
    assert _peaks(catalogue, import_bundle(catalogue, bundle)) == [pytest.approx(100.0, rel=1e-3), *others]


def _peaks(catalogue: Catalogue, run: int) -> list[float]:
    with catalogue.reading() as session:
        query = text("SELECT peak_force FROM v_blows WHERE run_id = :run ORDER BY blow_id")
        return list(session.scalars(query, {"run": run}))


def test_two_runs_measured_here_make_one_bundle(
    catalogue: Catalogue, filled: int, tmp_path: Path, samples: SimpleNamespace
) -> None:
    with catalogue.reading() as session:
        (sweep,) = list_runs(session, kind="sweep")
    export_bundle(catalogue, filled, tmp_path / "out", also=[sweep.id])
    found = read_bundle(tmp_path / "out")
    assert found.warnings == ()
    stored = samples.waveform("hammer", "N", "accelerometer", "m/s^2")
    np.testing.assert_array_equal(found.blows[0].force, stored.value("hammer"))
    np.testing.assert_array_equal(found.blows[0].acceleration, stored.value("accelerometer"))
    assert [blow.file for blow in found.blows] == [
        f"blow_{point}_set1_{number:02}.unv" for point in ("1y", "4y") for number in (1, 3)
    ]
    np.testing.assert_array_equal(found.inverse[0].accelerance, samples.frequency_responses().accelerance)
    assert found.direct[0].sd_rel == pytest.approx(700.0 / 7.1e5)


@pytest.mark.parametrize(
    ("kind", "changes", "blows", "said"),
    [
        ("hammer", {}, True, "two blows are named blow_1y_set1_01.unv; export the runs one by one, or without blows"),
        ("sweep", {}, True, "runs 1, 2, 3 have two sine points of order 1; export the sweeps one by one"),
        (
            "sweep",
            {"article": "beam 4"},
            False,
            "run 3 is of article 'beam 4', run 1 of 'beam 3'; export each by itself",
        ),
    ],
)
def test_runs_that_do_not_fit_into_one_bundle_are_refused(
    catalogue: Catalogue, filled: int, samples: SimpleNamespace, tmp_path: Path,
    kind: str, changes: dict[str, str], blows: bool, said: str,
) -> None:  # fmt: skip
    first = StoredDof(1, "y")
    about: dict[str, Any] = {"kind": kind, "title": "t", "article": "beam 3", "setup": {}, **changes}
    with catalogue.writing() as session:
        run = start_run(session, **about)
        record = catalogue.waveforms.append(run.waveform_file, samples.waveform("hammer", "N", "sensor", "m/s^2"))
        if kind == "hammer":
            add_blow(session, add_point(session, run.id, first), 1, accepted=True, waveform=record)
        else:
            analysis = add_analysis(session, kind="dynamic_stiffness", method="m", settings={}, runs=[run.id])
            add_dynamic_stiffness(session, analysis, samples.dynamic_stiffness())
    with pytest.raises(StoreError, match=said):
        export_bundle(catalogue, filled, tmp_path / "out", also=[filled + 1, run.id], blows=blows)
    assert not (tmp_path / "out").exists()


def test_blows_of_another_step_are_not_among_those_of_the_exported_set(
    catalogue: Catalogue, filled: int, samples: SimpleNamespace, tmp_path: Path
) -> None:
    with catalogue.writing() as session:
        file = get_run(session, filled).waveform_file
        record = catalogue.waveforms.append(file, samples.waveform("hammer", "N", "sensor", "m/s^2"))
        hung = add_point(session, filled, StoredDof(1, "y"), 2)  # the same beam in its cords
        add_blow(session, hung, 1, accepted=True, waveform=record)
    export_bundle(catalogue, filled, tmp_path / "out")
    names = [each.file for each in read_bundle(tmp_path / "out").blows]
    assert names
    assert not [each for each in names if "set2" in each]


@pytest.mark.parametrize("name", ["", " ", "beam\n3", "beam\x003"])
def test_an_article_or_a_joint_without_a_name_of_one_line_is_refused(
    catalogue: Catalogue, bundle: Path, row_counts: Counts, name: str
) -> None:
    before, original = row_counts(), read_bundle(bundle)
    first, *others = original.setup.joints
    for changed in ({"title": name}, {"joints": (first.model_copy(update={"name": name}), *others)}):
        with pytest.raises(StoreError, match="is called"):
            import_bundle(catalogue, replace(original, setup=original.setup.model_copy(update=changed)))
    assert row_counts() == before


def test_an_export_without_blows(catalogue: Catalogue, bundle: Path, tmp_path: Path) -> None:
    export_bundle(catalogue, import_bundle(catalogue, bundle), tmp_path / "out", blows=False)
    assert read_bundle(tmp_path / "out").blows == ()


def test_an_exported_bundle_carries_the_checksum_of_every_file(exported: Path) -> None:
    checksums = json.loads((exported / "setup.json").read_text())["checksums"]
    files = {path.relative_to(exported).as_posix(): path for path in exported.rglob("*.*") if path.name != "setup.json"}
    assert checksums == {name: hashlib.sha256(path.read_bytes()).hexdigest() for name, path in files.items()}


@pytest.mark.parametrize("name", ["setup.json", "direct.csv", "inverse_1.unv", "blows/blow_4y_set1_03.unv"])
def test_a_bundle_that_is_refused_stores_nothing(
    catalogue: Catalogue, row_counts: Counts, bundle: Path, name: str
) -> None:
    before = row_counts()
    content = (bundle / name).read_bytes()
    (bundle / name).write_bytes(content[: len(content) // 2])
    with pytest.raises(StoreError, match=Path(name).name):
        import_bundle(catalogue, bundle)
    assert row_counts() == before
    assert not catalogue.waveforms.folder.exists()


def test_an_import_that_fails_half_way_stores_nothing(
    catalogue: Catalogue, row_counts: Counts, bundle: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = row_counts()

    def fail(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("store.exchange.bundle_exchange.finish_run", fail)
    with pytest.raises(KeyboardInterrupt):
        import_bundle(catalogue, bundle)
    assert row_counts() == before
    assert list(catalogue.waveforms.folder.iterdir()) == []


def test_a_run_of_one_experiment_is_a_bundle_of_one(catalogue: Catalogue, filled: int, tmp_path: Path) -> None:
    export_bundle(catalogue, filled, tmp_path / "hammer")
    found = read_bundle(tmp_path / "hammer")
    assert found.inverse
    assert not found.direct


def test_a_run_whose_setup_is_not_that_of_a_bundle_is_not_exported(
    catalogue: Catalogue, filled: int, tmp_path: Path
) -> None:
    with catalogue.reading() as session:
        (sweep,) = list_runs(session, kind="sweep")
    with pytest.raises(StoreError, match=f"run {sweep.id} cannot be exported, its setup is not that of a bundle"):
        export_bundle(catalogue, sweep.id, tmp_path / "out", also=[filled])
    assert not (tmp_path / "out").exists()


def test_a_run_that_is_not_there_is_not_exported(catalogue: Catalogue, tmp_path: Path) -> None:
    with pytest.raises(NotFoundError, match="no run 77"):
        export_bundle(catalogue, 77, tmp_path / "out")


def test_nothing_is_written_over(catalogue: Catalogue, bundle: Path) -> None:
    with pytest.raises(StoreError, match="exists already"):
        export_bundle(catalogue, import_bundle(catalogue, bundle), bundle)


def test_a_damaged_waveform_stops_the_export(catalogue: Catalogue, bundle: Path, tmp_path: Path) -> None:
    run_id = import_bundle(catalogue, bundle)
    (path,) = catalogue.waveforms.folder.iterdir()
    content = bytearray(path.read_bytes())
    content[-1000] ^= 0xFF
    path.write_bytes(content)
    with pytest.raises(DamagedError, match=path.name):
        export_bundle(catalogue, run_id, tmp_path / "out")
    assert not (tmp_path / "out").exists()
