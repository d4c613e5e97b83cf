"""An automated test sequence: measure, identify by both methods, and show k, h and gamma.

    jointlab serve --simulated --speed 100          # in one terminal: a laboratory
    python docs/examples/automated_sequence.py      # in another one

A sequence document may be named, and another service: ``--sequence FILE --address URL --key KEY``. Where a person
strikes and mounts, add ``--no-automatic`` and answer the prompts on the page.
"""

import argparse
import sys
from pathlib import Path

from jointlab.client import Client, ProblemError
from rig.sequences.sequence_file import load_sequence
from store.states import JobState, RunState

TERMS = ("x", "y", "rotation")
NOT_FOUND = 404


def main() -> None:
    """Run the sequence; exit code 1 where it does not end well."""
    given = arguments()
    try:
        with Client(given.address, given.key) as lab:
            run = measure(lab, given.sequence, given.automatic)
            identify(lab, run)
            show(lab, run)
    except ProblemError as problem:
        sys.exit(f"{problem.title}: {problem}")


def measure(lab: Client, sequence: Path | None, automatic: bool) -> int:
    """Carry out a sequence, the paper's where none is named; the number of its run."""
    run = lab.create_run("paper" if sequence is None else load_sequence(sequence))
    with lab.driving("automated sequence") as rig:
        rig.start(run.id, automatic=automatic)
        ended = lab.wait_for_run(run.id)
    if ended.state is not RunState.FINISHED:
        sys.exit(f"run {run.id} {ended.state}: {ended.reason}")
    return run.id


def identify(lab: Client, run: int) -> None:
    """Identify a run by both methods; the results are in the database then."""
    job = lab.wait_for_job(lab.identify(run).id)
    if job.state is not JobState.DONE:
        sys.exit(f"identification of run {run} {job.state}: {job.error}")


def show(lab: Client, run: int) -> None:
    """k, h and gamma of each joint: inverse by two methods, direct at every amplitude."""
    for joint in lab.joint_matrices(run):
        for row, term in enumerate(TERMS):
            k, h, gamma = joint.k[row][row], joint.h[row][row], joint.gamma[row][row]
            loss = "not known" if gamma is None else f"{gamma:.3f}"
            print(f"run {run}, joint {joint.joint}, {joint.method}: {term}: k {k:.4g}, h {h:.4g}, gamma {loss}")
    for point in lab.dynamic_stiffness(run):
        print(
            f"run {run}, joint {point.specimen}, direct, {point.configuration}, {point.amplitude_pp_mm:g} mm, "
            f"{point.frequency:.0f} Hz: k {point.stiffness:.4g}, h {point.damping:.4g}, gamma {point.loss_factor:.3f}"
        )
    try:
        for each in lab.comparisons(run):
            print(f"run {run}, joint {each.joint}, {each.element}: {each.verdict}")
    except ProblemError as problem:
        if problem.status != NOT_FOUND:
            raise
        print(f"run {run}: {problem}")  # such as joints of a fit that failed its checks


def arguments() -> argparse.Namespace:
    """What the command line says."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--address", default="http://127.0.0.1:8000")
    parser.add_argument("--key", default=None)
    parser.add_argument("--sequence", type=Path, default=None)
    parser.add_argument("--automatic", action=argparse.BooleanOptionalAction, default=True)
    return parser.parse_args()


if __name__ == "__main__":
    main()
