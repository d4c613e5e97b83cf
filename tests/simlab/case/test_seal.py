"""A case's bench commits to its truth before anything is measured."""

from __future__ import annotations

import hashlib
import json

from simlab.bench import case_bench
from simlab.case.bundle import truth
from simlab.case.draw import CaseKind, draw_case
from simlab.case.seal import commitment, sealed
from simlab.clock import Clock

CASE = draw_case(3, CaseKind.SINGLE, ["joint_mass"])


def test_a_bench_opens_what_it_committed_to() -> None:
    bench = case_bench(CASE, Clock(1.0))
    committed = bench.commitment()
    seal = bench.open_seal()
    assert commitment(seal) == committed == bench.commitment()
    assert seal["truth"]["effects"] == ["joint_mass"]
    # over the operator's line it comes as JSON, and is still what the hash is of
    assert commitment(json.loads(json.dumps(seal))) == committed


def test_a_commitment_is_a_hash_of_nonce_and_truth_that_chance_keeps_from_being_guessed() -> None:
    seal = sealed(truth(CASE))
    text = json.dumps(seal, sort_keys=True, separators=(",", ":"))
    assert commitment(seal) == hashlib.sha256(text.encode()).hexdigest()
    assert commitment(sealed(truth(CASE))) != commitment(seal)
    changed = seal | {"truth": seal["truth"] | {"effects": []}}
    assert commitment(changed) != commitment(seal)
