"""setup.json: every value comes back, an unknown key gives a warning, a wrong value is refused by key."""

import copy
import json
from typing import Any

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from store.dof import StoredDof
from store.errors import StoreError
from store.exchange.bundle_setup import BundleSetup, parse_setup

WHOLE: dict[str, Any] = {
    "format": "jointlab-bundle/1",
    "title": "supported beam",
    "beam": {
        "length": 0.914, "height": 0.0254, "width": 0.0507874, "youngs_modulus": 207e9,
        "poisson_ratio": 0.3, "density": 7850, "free_damping_ratios": [0.004],
    },
    "node_positions": [0.0, 0.06, 0.5, 0.85, 0.914],
    "joints": [
        {"name": "I", "node": 2, "inclinations_deg": [-45, 135], "eccentricity": 0.006, "added_mass": 0.0},
        {"name": "II", "node": 4, "inclinations_deg": [45, -135], "eccentricity": 0.006, "added_mass": 0.0},
    ],
    "accelerometer": {"node": 3, "direction": "y", "mass": 0.0},
    "inverse": [
        {"file": "inverse_1.unv", "averages": 10, "peak_force": 100.0, "temperature_c": 23.0, "window": "none",
         "sample_rate": 4096, "block_seconds": 2.0},
    ],
    "direct": {"file": "direct.csv", "preset_mm": 0.5},
    "tolerances": {
        "node_position": 0.001, "sensor_gain": 0.005, "youngs_modulus": 0.005, "density": 0.003,
        "impact_position": 0.0015, "inclination_deg": 0.5, "tester_gain": 0.003,
    },
    "predict": [{"response": [3, "y"], "input": [5, "y"]}],
}  # fmt: skip


def changed(path: str, value: Any) -> dict[str, Any]:
    document = copy.deepcopy(WHOLE)
    *parents, last = (int(key) if key.isdigit() else key for key in path.split("."))
    at: Any = document
    for key in parents:
        at = at[key]
    if value is KeyError:
        del at[last]
    else:
        at[last] = value
    return document


def parse(document: Any) -> tuple[BundleSetup, tuple[str, ...]]:
    return parse_setup(json.dumps(document).encode())


def test_a_setup_comes_back_with_every_value() -> None:
    setup, warnings = parse(WHOLE)
    assert warnings == ()
    assert setup.beam.youngs_modulus == 207e9
    assert setup.joints[1].inclinations_deg == (45, -135)
    assert setup.specimens == ("I", "II")
    assert setup.predict[0].input == (5, "y")
    assert parse(setup.model_dump(mode="json"))[0] == setup


def test_unknown_keys_are_ignored_with_a_warning_each() -> None:
    document = changed("operator", "K")
    document["joints"][1]["colour"] = "black"
    setup, warnings = parse(document)
    assert setup == parse(WHOLE)[0]
    assert warnings == (
        "setup.json: unknown key joints.1.colour is ignored",
        "setup.json: unknown key operator is ignored",
    )


KEYS = [
    "beam", "beam.length", "beam.free_damping_ratios", "node_positions", "joints", "joints.0.node", "accelerometer",
    "accelerometer.direction", "inverse.0.file", "inverse.0.peak_force", "direct.preset_mm",
    "tolerances", "tolerances.tester_gain", "title",
]  # fmt: skip


@pytest.mark.parametrize("key", KEYS)
def test_a_missing_key_is_named(key: str) -> None:
    with pytest.raises(StoreError, match=rf"setup\.json: {key}: is missing"):
        parse(changed(key, KeyError))


@pytest.mark.parametrize("key", ["inverse", "direct"])
def test_one_of_both_rigs_may_be_missing(key: str) -> None:
    setup, _ = parse(changed(key, KeyError))
    assert not getattr(setup, key)


def test_both_rigs_may_not_be_missing() -> None:
    document = changed("inverse", KeyError)
    del document["direct"]
    with pytest.raises(StoreError, match="neither a hammer set in inverse nor a table of the tester in direct"):
        parse(document)


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("format", "jointlab-bundle/9", "format is 'jointlab-bundle/9'"),
        ("format", KeyError, "format is None"),
        ("beam.length", "0.914", "beam.length: is '0.914', which is no number"),
        ("beam.length", 914.0, "beam.length: .*100 m or less"),
        ("beam.youngs_modulus", 207, "beam.youngs_modulus: .*it has to be 1e\\+06 Pa or more"),
        ("beam.density", 7.85, "beam.density: .*10 kg/m\\^3 or more"),
        ("beam.poisson_ratio", 0.5, "beam.poisson_ratio"),
        ("beam.length", True, "beam.length"),
        ("node_positions", [0.0], "node_positions: has 1 values; it needs 2 or more"),
        ("node_positions", [0.0, 0.5, 0.5, 0.8, 0.9], "node_positions do not rise"),
        ("node_positions", [0.0, 60.0, 500.0, 850.0, 914.0], "beyond the beam's length"),
        ("joints.1.node", 11, "joint II is at node 11; node_positions has 5"),
        ("joints.1.node", 0, "joints.1.node"),
        ("joints.1.name", "I", "joints: a name comes twice"),
        ("joints.0.inclinations_deg", [45], "joints.0.inclinations_deg"),
        ("joints.0.inclinations_deg.1", 1e300, "joints.0.inclinations_deg.1: .*360 deg or less"),
        ("joints.0.eccentricity", 6.0, "the eccentricity of joint I is 6 m; with this beam .* 0.914 m or less"),
        ("joints.1.added_mass", 1200.0, "the mass added at joint II is 1200 kg; with this beam .* 92.6 kg or less"),
        ("accelerometer.mass", 24.0, "the mass of the accelerometer is 24 kg; with this beam .* 9.26 kg or less"),
        ("beam.free_damping_ratios.0", 0.4, "beam.free_damping_ratios.0: .*0.2 or less"),
        ("accelerometer.direction", "z", "accelerometer.direction"),
        ("accelerometer.node", 6, "the accelerometer is at node 6"),
        ("inverse.0.averages", 0, "inverse.0.averages"),
        ("inverse.0.excitation", "noise", "inverse.0.excitation"),
        ("inverse.0.averages", 10**30, "inverse.0.averages"),
        ("inverse.0.file", "../inverse_1.unv", "inverse.0.file: is not the plain name"),
        ("inverse.0.file", "/etc/passwd", "inverse.0.file: is not the plain name"),
        ("inverse.0.file", "a\\b.unv", "inverse.0.file: is not the plain name"),
        ("inverse.0.file", "direct.csv", "a file comes twice"),
        ("direct.file", "setup.json", "a file comes twice"),
        ("predict.0.input", [6, "y"], "a predicted input is at node 6"),
        ("predict.0.input", [5, "z"], "predict.0.input"),
        ("checksums", {"direct.csv": "abc"}, "checksums.direct.csv"),
    ],
)
def test_a_wrong_value_is_refused_by_its_key(key: str, value: Any, said: str) -> None:
    with pytest.raises(StoreError, match=rf"setup\.json: .*{said}"):
        parse(changed(key, value))


@pytest.mark.parametrize(
    "content",
    [
        b"", b"{", b"[]", b"null", b"\xff\xfe", b"[" * 100_000, b'{"format": NaN}',
        json.dumps(changed("beam.length", float("nan"))).encode(), json.dumps(WHOLE).replace("0.914", "1e999").encode(),
    ],
)  # fmt: skip
def test_a_document_that_is_no_json_object_of_numbers_is_refused(content: bytes) -> None:
    with pytest.raises(StoreError, match=r"^setup\.json"):
        parse_setup(content)


@pytest.mark.parametrize(("first", "second"), [("length", '"length": 0.914'), ("tolerances", '"tolerances": {}')])
def test_a_key_that_comes_twice_is_refused(first: str, second: str) -> None:
    content = json.dumps(WHOLE).replace(f'"{first}"', f'{second}, "{first}"', 1)
    with pytest.raises(StoreError, match=f"^setup.json is not JSON: the key '{first}' comes twice in one object"):
        parse_setup(content.encode())


def test_a_point_that_the_beam_does_not_have_is_refused() -> None:
    setup, _ = parse(WHOLE)
    setup.check_node(StoredDof(5, "x"), "a.unv")
    for dof in (StoredDof(6, "y"), StoredDof(1, "r")):
        with pytest.raises(StoreError, match=f"a.unv: unknown point {dof}"):
            setup.check_node(dof, "a.unv")


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=5,
)


@example(key="checksums", value={"\n": None})
@given(key=st.sampled_from([*KEYS, "format", "predict", "checksums", "joints.0", "inverse.0"]), value=JSON)
def test_any_value_under_any_key_gives_a_setup_or_an_error_of_the_store(key: str, value: Any) -> None:
    said, setup = "", None
    try:
        setup, _ = parse(changed(key, value))
    except StoreError as error:
        said = str(error)
    assert setup is not None or (said.startswith("setup.json") and "\n" not in said)


@given(st.data())
def test_any_damage_gives_a_setup_or_an_error_of_the_store(data: st.DataObject) -> None:
    content = bytearray(json.dumps(WHOLE).encode())
    for _ in range(data.draw(st.integers(1, 3))):
        at = data.draw(st.integers(0, len(content) - 1))
        content[at : at + data.draw(st.integers(0, 8))] = data.draw(st.binary(max_size=8))
    said, setup = "", None
    try:
        setup, _ = parse_setup(bytes(content))
    except StoreError as error:
        said = str(error)
    assert setup is not None or said.startswith("setup.json")
