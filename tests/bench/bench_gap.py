"""A sealed trial of the gap diagnosis: how often it is right, how sure, and how long it takes.

JOINTLAB_TRIAL_CASES says how many cases (16), JOINTLAB_TRIAL_SEED which (1), JOINTLAB_TRIAL_FOLDER where they are kept:
a trial that was interrupted goes on there.
"""

import os
from pathlib import Path
from tempfile import TemporaryDirectory

from api.commands.terminal import progress_bar
from jointlab.trials.run import TrialSettings, carry_out
from jointlab.trials.summary import markdown


def main() -> None:
    """Carry out the trial and print its tables."""
    cases = int(os.environ.get("JOINTLAB_TRIAL_CASES", "16"))
    seed = int(os.environ.get("JOINTLAB_TRIAL_SEED", "1"))
    with TemporaryDirectory() as scratch:
        folder = Path(os.environ.get("JOINTLAB_TRIAL_FOLDER", scratch))
        scores = carry_out(TrialSettings(cases, seed, folder), progress_bar)
    print(markdown(scores))
