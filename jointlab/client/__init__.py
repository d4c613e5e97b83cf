"""The typed Python client of the service, for automated test sequences.

with Client("http://127.0.0.1:8000", key) as lab:
    run = lab.create_run("paper")
    with lab.driving("nightly sequence") as rig:
        rig.start(run.id)
        lab.wait_for_run(run.id)
    lab.wait_for_job(lab.identify(run.id).id)
    matrices = list(lab.joint_matrices(run.id))
"""

from jointlab.client.client import Client
from jointlab.client.connection import ProblemError
from jointlab.client.driving import Driver

__all__ = ["Client", "Driver", "ProblemError"]
