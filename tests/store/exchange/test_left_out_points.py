"""Sine points that a bundle cannot hold: refused by default, left out where that is asked for, never silently."""

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from store.catalogue import Catalogue
from store.errors import StoreError
from store.exchange.bundle import read_bundle
from store.exchange.bundle_exchange import UnfitPointsError, export_bundle, import_bundle
from store.results.analyses import add_analysis
from store.results.dynamic_stiffness import StoredStiffness, add_dynamic_stiffness
from store.states import AnalysisKind

BEYOND: dict[str, Any] = {"loss_angle_deg": 95.0}
WITHOUT: dict[str, Any] = {"temperature_c": None}
LEFT_OUT = [
    "sine point 2 (I, shear, 0.1 mm p-p, 5 Hz) was left out at the export: phase_deg of direct.csv cannot be 95.0",
    "sine point 3 (I, shear, 0.1 mm p-p, 5 Hz) was left out at the export: direct.csv needs its temperature",
]


def with_points(catalogue: Catalogue, run: int, samples: SimpleNamespace, *changes: dict[str, Any]) -> None:
    """Give the run points in shear, the first of them good, and each further one changed."""
    good: StoredStiffness = replace(
        samples.dynamic_stiffness()[0],
        specimen="I", configuration="shear", amplitude_pp_mm=0.1, frequency=5.0, reached_frequency=None,
        sine_record_id=None,
    )  # fmt: skip
    points = [replace(good, order_number=1)]
    points += [replace(good, order_number=order, **change) for order, change in enumerate(changes, start=2)]
    with catalogue.writing() as session:
        analysis = add_analysis(session, kind=AnalysisKind.DYNAMIC_STIFFNESS, method="later", settings={}, runs=[run])
        add_dynamic_stiffness(session, analysis, points)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ((BEYOND,), "sine point 2 cannot be exported: phase_deg of direct.csv cannot be 95.0$"),
        ((WITHOUT,), "sine point 2 cannot be exported: direct.csv needs its temperature$"),
        ((BEYOND, WITHOUT), "sine point 2 cannot be exported: phase_deg .* cannot be 95.0, and 1 more cannot$"),
    ],
)  # fmt: skip
def test_a_refusal_names_the_point_and_has_them_all(
    catalogue: Catalogue, filled: int, samples: SimpleNamespace, tmp_path: Path,
    changes: tuple[dict[str, Any], ...], said: str,
) -> None:  # fmt: skip
    with_points(catalogue, filled, samples, *changes)
    with pytest.raises(UnfitPointsError, match=said) as refused:
        export_bundle(catalogue, filled, tmp_path / "out")
    assert [point.order for point in refused.value.points] == [2, 3][: len(changes)]
    assert not (tmp_path / "out").exists()


def test_points_are_left_out_on_request_and_the_bundle_says_which_and_why(
    catalogue: Catalogue, filled: int, samples: SimpleNamespace, tmp_path: Path
) -> None:
    with_points(catalogue, filled, samples, BEYOND, WITHOUT)
    left_out = export_bundle(catalogue, filled, tmp_path / "out", leave_out_unfit_points=True)
    assert list(map(str, left_out)) == LEFT_OUT
    found = read_bundle(tmp_path / "out")
    assert [point.order for point in found.direct] == [1]
    assert found.inverse
    assert found.blows
    assert list(found.warnings) == LEFT_OUT
    listed = json.loads((tmp_path / "out" / "setup.json").read_text(encoding="utf-8"))["sine_points_left_out"]
    assert listed[1] == {
        "order": 3, "specimen": "I", "configuration": "shear", "amplitude_pp_mm": 0.1, "frequency_hz": 5.0,
        "why": "direct.csv needs its temperature",
    }  # fmt: skip


def test_what_was_left_out_stays_known_through_an_import(
    catalogue: Catalogue, filled: int, samples: SimpleNamespace, tmp_path: Path
) -> None:
    with_points(catalogue, filled, samples, BEYOND, WITHOUT)
    export_bundle(catalogue, filled, tmp_path / "out", leave_out_unfit_points=True)
    again = export_bundle(catalogue, import_bundle(catalogue, tmp_path / "out"), tmp_path / "again")
    assert list(map(str, again)) == LEFT_OUT
    assert list(read_bundle(tmp_path / "again").warnings) == LEFT_OUT


def test_a_bundle_of_points_that_all_fit_has_no_such_list(
    catalogue: Catalogue, filled: int, samples: SimpleNamespace, tmp_path: Path
) -> None:
    with_points(catalogue, filled, samples, {})
    assert export_bundle(catalogue, filled, tmp_path / "out", leave_out_unfit_points=True) == ()
    assert "sine_points_left_out" not in json.loads((tmp_path / "out" / "setup.json").read_text(encoding="utf-8"))
    assert read_bundle(tmp_path / "out").warnings == ()


def test_accelerances_are_exported_where_no_point_fits(
    catalogue: Catalogue, filled: int, samples: SimpleNamespace, tmp_path: Path
) -> None:
    with catalogue.writing() as session:
        analysis = add_analysis(
            session, kind=AnalysisKind.DYNAMIC_STIFFNESS, method="later", settings={}, runs=[filled]
        )
        add_dynamic_stiffness(session, analysis, [replace(samples.dynamic_stiffness()[0], temperature_c=None)])
    (left_out,) = export_bundle(catalogue, filled, tmp_path / "out", leave_out_unfit_points=True)
    found = read_bundle(tmp_path / "out")
    assert found.inverse
    assert not found.direct
    assert found.setup.direct is None
    assert list(found.warnings) == [str(left_out)]


def test_a_sweep_without_a_point_that_fits_is_refused(
    catalogue: Catalogue, filled: int, samples: SimpleNamespace, tmp_path: Path
) -> None:
    sweep = filled + 1
    with catalogue.writing() as session:
        analysis = add_analysis(session, kind=AnalysisKind.DYNAMIC_STIFFNESS, method="later", settings={}, runs=[sweep])
        add_dynamic_stiffness(session, analysis, [replace(samples.dynamic_stiffness()[0], temperature_c=None)])
    with pytest.raises(StoreError, match=f"run {sweep} has no frequency responses, and none of its 1 sine points fits"):
        export_bundle(catalogue, sweep, tmp_path / "out", leave_out_unfit_points=True)
    assert not (tmp_path / "out").exists()
