"""A diagnosis as the contract has it, small and made up: what the view shows of it is what is tested."""

from typing import Any

from store.catalogue import Catalogue
from store.results.analyses import add_analysis
from store.results.diagnoses import StoredDiagnosis, add_diagnosis
from store.states import AnalysisKind


def example_document() -> dict[str, Any]:
    """Two effects, of which one explains the gap; a law of the joints; a map of three rows and four bands."""
    found = {"value": 0.02, "ci90": [0.018, 0.022], "unit": "1"}
    return {
        "format": "jointlab-diagnosis/1",
        "gap": {
            "before": {"percent": 12.3, "sigma": 41.0},
            "after": {"percent": 3.1, "sigma": 1.2},
            "after_ci90_percent": [2.8, 3.5],
            "floor_percent": 2.9,
            "held_out": True,
            "by_rig": {
                "inverse": {"before": 11.0, "after": 3.0, "before_sigma": 41.0, "after_sigma": 1.2},
                "direct": {"before": 14.0, "after": 3.3, "before_sigma": 20.0, "after_sigma": 1.1},
            },
        },
        "where": [
            {
                "rig": "inverse",
                "input": "1x",
                "response": "3y",
                "band_hz": [300, 360],
                "level": 1,
                "part": "magnitude",
                "share": 0.41,
                "significance": 25.0,
            }
        ],
        "ranking": [
            {
                "effects": ["out_of_plane_bending"],
                "laws": {"out_of_plane_bending": ""},
                "probability": 0.93,
                "held_out_gap_percent": 3.1,
                "held_out_ci90_percent": [2.8, 3.5],
                "explained": 0.97,
                "parameters": {"out_of_plane_bending": {"coupling": found}},
            },
            {
                "effects": ["unknown"],
                "laws": {},
                "probability": 0.06,
                "held_out_gap_percent": None,
                "held_out_ci90_percent": [None, None],
                "explained": 0.0,
                "parameters": {},
            },
            {
                "effects": [],
                "laws": {},
                "probability": 0.01,
                "held_out_gap_percent": 12.3,
                "held_out_ci90_percent": [11.0, 13.0],
                "explained": 0.0,
                "parameters": {},
            },
        ],
        "verdict": {
            "status": "explained",
            "effects": ["out_of_plane_bending"],
            "twins": [["cross_axis_sensitivity", "out_of_plane_bending"]],
            "next_experiment": "turn the accelerometer, or use one of three axes: 90 % of the doubt gone in 20 min",
            "experiment": {
                "id": "turn_accelerometer",
                "effects": ["cross_axis_sensitivity", "out_of_plane_bending"],
                "tells_apart": True,
                "information": 0.9,
                "doubt": 1.0,
                "minutes": 20.0,
                "corrections": [],
            },
        },
        "titles": {
            "out_of_plane_bending": "the bar bends out of plane",
            "cross_axis_sensitivity": "cross axis",
            "amplitude_dependence": "joints that follow amplitude",
        },
        "maps": [
            {
                "title": "Beam rig, level 1",
                "rows": ["1y", "3y", "1x"],
                "edges_hz": [0, 100, 300, 360, 1024],
                "energy": [[1, 2, 3, 1], [1, 1, 2, 1], [2, 9, 410, 8]],
                "significance": [[0.1, 0.4, 1.1, 0.2], [0.3, 0.2, 0.9, 0.1], [0.8, 3.1, 25.0, 2.2]],
            }
        ],
        "effects": [
            {
                "id": "amplitude_dependence",
                "probability": 0.61,
                "mechanism": "joint_amplitude",
                "law": "Kraus, bent",
                "law_is_known": True,
                "parameters": {},
                "out_of_range": [],
                "law_found": law_found(),
            }
        ],
        "curves": [row("3y", 12.0, 3.0), row("1x", 11.0, 2.9), series()],
        "faults": [],
        "trial": {"cases": 200, "strength": "strong", "named": 9, "right": 8, "confidence": {"named": 60, "right": 55}},
        "seconds": 12.0,
    }


def law_found() -> dict[str, Any]:
    """Joints that soften with amplitude, by a law that bends."""
    softer = {"value": [1.0, 0.9, 0.8], "ci90": [[1.0, 0.89, 0.78], [1.0, 0.91, 0.82]]}
    loss = {"value": [0.1, 0.11, 0.125], "ci90": [[0.1, 0.109, 0.123], [0.1, 0.111, 0.128]]}
    ratio = {"value": [1.0, 1.1, 1.25], "ci90": [[1.0, 1.09, 1.23], [1.0, 1.11, 1.28]]}
    axis = {"stiffness": softer, "loss_factor": loss, "loss_ratio": ratio}
    place = {"over": "amplitude", "unit": "m", "at": [1e-6, 3e-6, 1e-5]}
    return place | {"compression": axis, "shear": axis, "closest_law": "Kraus"}


def row(point: str, before: float, after: float) -> dict[str, Any]:
    """Three lines of a row of the beam."""
    values = {"measured": [1.0, 2.0, 1.5], "before": [1.1, 1.8, 1.4], "after": [1.0, 2.0, 1.5]}
    gap = {"before": {"percent": before, "sigma": 41.0}, "after": {"percent": after, "sigma": 1.2}}
    place = {"rig": "inverse", "input": point, "response": "3y", "level": 1, "close_up_hz": [300.0, 360.0]}
    phases = {name: [0.0, -90.0, 170.0] for name in values}
    return place | {"gap": gap, "frequency_hz": [100.0, 300.0, 360.0], "magnitude": values, "phase_deg": phases}


def series() -> dict[str, Any]:
    """Two points of a series of the tester."""
    values = {"measured": [2.0e6, 2.2e6], "before": [2.1e6, 2.1e6], "after": [2.0e6, 2.2e6]}
    gap = {"before": {"percent": 4.0, "sigma": 9.0}, "after": {"percent": 1.0, "sigma": 1.1}}
    place = {"rig": "direct", "specimen": "I", "configuration": "shear", "amplitude_pp_mm": 0.1}
    loss = {name: [0.1, 0.12] for name in values}
    return place | {"gap": gap, "frequency_hz": [5.0, 200.0], "stiffness": values, "loss_factor": loss}


def add_example_diagnosis(catalogue: Catalogue, run_id: int) -> int:
    """Store the example as a diagnosis of a run; its number."""
    document = example_document()
    with catalogue.writing() as session:
        analysis = add_analysis(
            session, kind=AnalysisKind.DIAGNOSES, method=document["format"], settings={}, runs=[run_id]
        )
        add_diagnosis(
            session,
            StoredDiagnosis(
                analysis_id=analysis,
                status=document["verdict"]["status"],
                effects=tuple(document["verdict"]["effects"]),
                gap_before_percent=document["gap"]["before"]["percent"],
                gap_after_percent=document["gap"]["after"]["percent"],
                document=document,
            ),
        )
    return analysis
