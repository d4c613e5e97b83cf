"""The client of one service."""

from typing import Self

from jointlab.client.connection import Connection
from jointlab.client.investigations import InvestigationRequests
from jointlab.client.jobs import JobRequests
from jointlab.client.laboratory import LaboratoryRequests
from jointlab.client.results import ResultRequests
from jointlab.client.rig import RigRequests
from jointlab.client.runs import RunRequests
from jointlab.documents.laboratory import Health, Ready


class Client(RigRequests, LaboratoryRequests, RunRequests, ResultRequests, JobRequests, InvestigationRequests):
    """One service. A context manager; methods raise `ProblemError` where the service says why it cannot.

    Args:
        address: such as ``http://127.0.0.1:8000``.
        key: made by ``jointlab key create``; None on a computer where no key is needed.
        timeout: s that an answer may take.
    """

    def __init__(self, address: str = "http://127.0.0.1:8000", key: str | None = None, timeout: float = 30.0) -> None:
        self._connection = Connection(address, key, timeout)

    def close(self) -> None:
        """Close the connection."""
        self._connection.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        self.close()

    def health(self) -> Health:
        """Whether the service can do its work."""
        return self._connection.get(Health, "/health")

    def ready(self) -> Ready:
        """That the service can do its work now; ProblemError names what is missing."""
        return self._connection.get(Ready, "/health/ready")
