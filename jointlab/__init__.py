"""Jointlab from Python: modes, joints and the gap in a few lines, each as a table and in full detail.

    import jointlab

    jointlab.modes("beam.unv")                                        # frequencies and loss factors
    jointlab.identify("bundle/")                                      # k, h and gamma of the joints
    jointlab.stiffness("bundle/", amplitude_pp_mm=0.03, frequency=80) # of a cylinder and a joint
    jointlab.diagnose("bundle/")                                      # why simulation and measurement differ

`import jointlab` loads nothing else; a name loads what it needs when it is first used. The functions take a bundle,
or a catalogue and the number of a run, and return a `Result`. They raise `JointlabError` (`jointlab.errors`),
`AnalysisError` (`analysis.errors`) or `StoreError` (`store.errors`).
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from jointlab.client import Client
    from jointlab.identification.options import Options
    from jointlab.notebook import (
        diagnose,
        identify,
        modes,
        open_catalogue,
        read_bundle,
        read_uff,
        stiffness,
        write_report,
    )
    from jointlab.result import Result

__all__ = [
    "Options",
    "Result",
    "connect",
    "diagnose",
    "identify",
    "modes",
    "open_catalogue",
    "read_bundle",
    "read_uff",
    "stiffness",
    "write_report",
]


def connect(address: str = "http://127.0.0.1:8000", key: str | None = None, timeout: float = 30.0) -> Client:
    """Connect to a running service.

    Args:
        address: of the service.
        key: made by ``jointlab key create``; None on a computer where no key is needed.
        timeout: s that an answer may take.

    Returns:
        The client, a context manager; its methods raise `jointlab.client.ProblemError` where the service says why it
        cannot.

    For example:

        with jointlab.connect("http://laboratory:8000", key="jl_...") as lab:
            runs = list(lab.runs())
    """
    from jointlab.client import Client

    return Client(address, key, timeout)


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module 'jointlab' has no attribute {name!r}")
    elsewhere = {"Options": "jointlab.identification.options", "Result": "jointlab.result"}
    return getattr(import_module(elsewhere.get(name, "jointlab.notebook")), name)


def __dir__() -> list[str]:
    return __all__
