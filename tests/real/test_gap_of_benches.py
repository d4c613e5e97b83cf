"""Labelled bundles of a simulator with other laws and ordinary nuisances; `bench_foreign` runs all of them."""

from jointlab.diagnosis.pipeline import diagnose_bundle
from tests.recordings import Recording


def test_a_bench_with_nothing_but_what_every_bench_has_raises_no_alarm(recording: Recording) -> None:
    """Half a per cent between set-ups, one between configurations and 0.3 % of smooth error were an unknown cause."""
    document = diagnose_bundle(recording("benches/ordinary-1")).document
    assert document["verdict"]["status"] == "none"
    assert document["effects"] == [] or max(each["probability"] for each in document["effects"]) < 0.5
    assert not document["remainder"]["significant"]
    assert 0 < document["nuisances"]["configuration_gain"] < 0.03
