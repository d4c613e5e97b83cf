"""A case's bench commits to its truth before anything is measured."""

from __future__ import annotations

import hashlib
import json

from simlab.case.bench import CaseBench
from simlab.case.draw import Kind, draw_case
from simlab.case.seal import commitment, sealed
from simlab.clock import Clock

CASE = draw_case(3, Kind.SINGLE, ["joint_mass"])


def test_a_bench_opens_what_it_committed_to() -> None:
    bench = CaseBench(CASE, Clock(1.0))
    committed = bench.commitment()
    seal = bench.open_seal()
    assert commitment(seal) == committed == bench.commitment()
    assert seal["truth"]["effects"] == ["joint_mass"]
    # over the hand's line it comes as JSON, and is still what the hash is of
    assert commitment(json.loads(json.dumps(seal))) == committed


def test_a_commitment_is_a_hash_of_nonce_and_truth_that_chance_keeps_from_being_guessed() -> None:
    seal = sealed(CASE)
    text = json.dumps(seal, sort_keys=True, separators=(",", ":"))
    assert commitment(seal) == hashlib.sha256(text.encode()).hexdigest()
    assert commitment(sealed(CASE)) != commitment(seal)
    changed = seal | {"truth": seal["truth"] | {"effects": []}}
    assert commitment(changed) != commitment(seal)
