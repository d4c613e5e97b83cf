"""The commands on data that others recorded."""

import json
from pathlib import Path

import numpy as np
import pytest

from store.dof import StoredDof
from store.exchange.accelerance_file import accelerance_functions
from store.exchange.uff import write_uff
from tests.api.conftest import Command, jointlab
from tests.recordings import Recording

__all__ = ["jointlab"]
BEAM_MODES = (51.5, 142.18, 278.66, 460.39, 687.16, 958.5)  # Hz, published with the measurement


def test_the_recorded_beam_has_its_six_modes_to_a_tenth_of_a_per_cent(jointlab: Command, recording: Recording) -> None:
    answer = jointlab("modes", recording("data/beam/beam_accelerance_derived.uff"), "--json")
    assert (answer.returncode, answer.stderr) == (0, "")
    found = json.loads(answer.stdout)
    assert found["frequency_hz"] == pytest.approx(BEAM_MODES, rel=1e-3)
    for name in ("loss_factor", "frequency_ci95", "loss_factor_ci95"):
        assert len(found[name]) == len(BEAM_MODES)
    assert all(0 < loss < 0.05 for loss in found["loss_factor"])
    assert found["fit"]["explained"] > 0.995
    assert 1 < found["fit"]["residual_over_noise"] < 10  # peaks narrower than their lines


def test_one_recorded_response_of_a_bench_has_modes_and_a_quality(
    jointlab: Command, recording: Recording, tmp_path: Path
) -> None:
    frequency, size, phase, *_ = np.loadtxt(recording("data/testbench/Y_B_exp_o3_i0.csv"), delimiter=",", skiprows=2).T
    point = StoredDof(1, "y")
    functions = accelerance_functions(point, [point], frequency, (size * np.exp(1j * phase))[None])
    write_uff(tmp_path / "bench.unv", functions, binary=False)
    found = json.loads(jointlab("modes", tmp_path / "bench.unv", "--json").stdout)
    assert min(abs(f - 699.4) for f in found["frequency_hz"]) < 0.5
    assert found["fit"]["explained"] > 0.998
    assert found["fit"]["residual_over_noise"] > 3  # lines of 5 Hz, smooth: more than noise is left


def test_modes_are_a_table_for_people(jointlab: Command, recording: Recording) -> None:
    answer = jointlab("modes", recording("data/beam/beam_accelerance_derived.uff"))
    _, head, *rows = answer.stdout.splitlines()
    assert head.split() == ["mode", "frequency", "(Hz)", "95", "%", "loss", "factor", "95", "%"]
    assert [float(row.split()[1]) for row in rows] == pytest.approx(BEAM_MODES, rel=1e-3)


@pytest.mark.parametrize("name", ["accelerometers_4ch.uff", "Sample_UFF58_ascii.uff", "Sample_UFF58b_bin.uff"])
def test_a_uff_file_without_accelerances_is_refused_with_what_it_holds(
    jointlab: Command, recording: Recording, name: str
) -> None:
    answer = jointlab("modes", recording(f"data/uff/{name}"))
    assert answer.returncode == 3
    (line,) = answer.stderr.splitlines()
    assert line.startswith(f"jointlab: {name}")


@pytest.mark.parametrize(
    "name", ["rubber_mount/Zj_00_digitised.csv", "friction_damper/kd_reference.csv", "beam/meas_point_1.txt"]
)
def test_a_recorded_table_is_no_uff_file(jointlab: Command, recording: Recording, name: str) -> None:
    answer = jointlab("modes", recording(f"data/{name}"))
    assert answer.returncode == 3
    (line,) = answer.stderr.splitlines()
    assert line.startswith(f"jointlab: {Path(name).name}")
