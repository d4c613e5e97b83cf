"""Seeded faults of the network on both wires: no hang, no wrong value, no command twice, the actuator safe."""

from tests.bench.bench_faults import DaqFaults, ModbusFaults


def test_forty_faults_of_the_modbus_wire_end_in_time_and_in_the_truth_or_in_words() -> None:
    findings = ModbusFaults(seed=11, timeout=0.06).run(40)
    assert findings.wrong == []
    assert findings.outcomes.total() == 40
    assert {outcome for _, outcome in findings.outcomes} == {"done", "error in words"}


def test_twenty_faults_of_the_daq_wire_end_in_time_and_in_the_truth_or_in_words() -> None:
    findings = DaqFaults(seed=12, timeout=0.1).run(20)
    assert findings.wrong == []
    assert findings.outcomes.total() == 20
