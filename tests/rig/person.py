"""The person who strikes and mounts in the tests of whole sequences."""

from collections.abc import Callable

from analysis.dof import Dof
from rig.operator import Operator
from simlab.laboratory import Laboratory


class Person(Operator):
    """Strikes and mounts at once; `before` is called before each action and may break something, or leave."""

    def __init__(self, laboratory: Laboratory) -> None:
        self.laboratory = laboratory
        self.before: Callable[[str, int], None] = lambda action, count: None
        self.what = "clean"
        self.counts = {"strike": 0, "mount": 0}
        self.requests: list[str] = []

    def strike(self, point: Dof, blow: int) -> None:
        self._note("strike", f"{point} {blow}")
        self.laboratory.bench.strike(point.node, point.direction.value, what=self.what)

    def mount(self, specimen: str, configuration: str) -> None:
        self._note("mount", f"{specimen} {configuration}")
        self.laboratory.bench.mount(specimen, configuration)

    def _note(self, action: str, which: str) -> None:
        self.counts[action] += 1
        self.requests.append(which)
        self.before(action, self.counts[action])

    def at(self, action: str, count: int, act: Callable[[], None]) -> None:
        """Let `act` happen before the `count`-th `action`."""
        self.before = lambda done, number: act() if (done, number) == (action, count) else None
