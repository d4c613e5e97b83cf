"""The stabilisation chart of a hammer set, as identification reads it."""

from __future__ import annotations

from analysis.frequency_response import FrequencyResponses
from analysis.modal.lscf import lscf_poles
from analysis.modal.stabilisation import Stabilisation, read_chart
from jointlab.identification.inverse import LOWEST_LINE

HIGHEST_ORDER = 60


def stabilisation_of(measured: FrequencyResponses) -> Stabilisation:
    """Poles of every model order up to `HIGHEST_ORDER`, of the lines that modes are found from."""
    lines = measured.band(LOWEST_LINE, float(measured.frequency[-1]))
    return read_chart(
        lscf_poles(lines.frequency, lines.accelerance, HIGHEST_ORDER),
        lowest=float(lines.frequency[0]),
        highest=float(lines.frequency[-1]),
        line_spacing=float(lines.frequency[1] - lines.frequency[0]),
        decay=lines.decay,
    )
