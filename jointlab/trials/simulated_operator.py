"""An operator in place of a technician; apart from the simulated laboratory, which takes half a second to import."""

from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from typing import Any

from analysis.dof import Dof
from jointlab.errors import JointlabError
from rig.errors import RequestError
from rig.events import Event, HammerStarted
from rig.operator import Operator
from simlab.operator_server import OperatorClient


class SimulatedOperator(Operator):
    """An operator who strikes and mounts on the simulated bench the moment a sequence asks for it."""

    def __init__(self, operator: OperatorClient) -> None:
        self._client = operator
        self._peak_force: float | None = None

    def observe(self, event: Event) -> None:
        """Strike as hard as the hammer step asks for."""
        if isinstance(event, HammerStarted):
            self._peak_force = event.peak_force

    def strike(self, point: Dof, blow: int) -> None:  # noqa: ARG002 - `Operator` has it; the bench needs the place alone
        """Strike `point`.

        Raises:
            RequestError: no hammer reaches that point of the bench.
        """
        self._do("strike", node=point.node, direction=point.direction.value, peak_force=self._peak_force)

    def mount(self, specimen: str, configuration: str) -> None:
        """Put the cylinders of joint `specimen` into the tester.

        Raises:
            RequestError: the bench has no such specimen or configuration.
        """
        self._do("mount", specimen=specimen, configuration=configuration)

    def run_points(self, preset: float, points: Sequence[tuple[float, float]]) -> None:
        """Let the simulated machine's own software run `points`; RequestError where it does not answer."""
        self._do("run_points", preset=preset, points=list(points))

    def do_task(self, text: str) -> None:  # noqa: ARG002 - `Operator` has it; words are for a person
        """Bring a machine that runs by its own software to rest."""
        self._do("rest")

    def _do(self, action: str, **arguments: Any) -> None:
        try:
            self._client.do(action, **arguments)
        except ValueError as error:
            raise RequestError(f"the simulated bench refuses: {error}") from error
        except OSError as error:
            raise RequestError(f"the simulated laboratory does not answer: {error}") from error


@contextmanager
def operator_at(address: str | None) -> Iterator[SimulatedOperator | None]:
    """The operator of a simulated bench at "host:port", while the context lasts; None where there is no address.

    Raises:
        JointlabError: nobody answers there.
    """
    if address is None:
        yield None
        return
    try:
        client = OperatorClient(address)
    except (OSError, ValueError) as error:
        raise JointlabError(
            f"simulated_operator {address}: nobody answers ({error}); start jointlab simulate, or take the line out of "
            "jointlab.toml"
        ) from error
    with closing(client):
        yield SimulatedOperator(client)
