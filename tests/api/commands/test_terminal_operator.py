"""The progress of a sequence at the terminal."""

import re
from io import StringIO

from rich.console import Console

from analysis.dof import Dof
from api.commands.terminal_operator import SequenceProgress
from jointlab.drive.events import BlowWithdrawn
from rig.events import BlowAccepted, RunStarted
from rig.sequences.sequence import sequence_from
from tests.rig.conftest import DOCUMENT


def test_a_blow_that_is_withdrawn_is_said_and_counts_no_more() -> None:
    console = Console(record=True, width=120, force_terminal=True, file=StringIO())
    with SequenceProgress(sequence_from(DOCUMENT), console) as progress:
        progress(RunStarted(7))
        for blow in (1, 2):
            progress(BlowAccepted(Dof.parse("3y"), blow, blow, 4, 120.0))
        progress(BlowWithdrawn(7, "3y", 2, "the cable hung down"))
        progress(BlowWithdrawn(6, "3y", 1, "of another run"))
    said = console.export_text()
    assert "blow 2 at 3y withdrawn: the cable hung down" in said
    assert "of another run" not in said
    assert re.findall(r"blows\b.* (\d)/\d", said)[-1] == "1"
