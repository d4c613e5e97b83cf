"""An operator of a machine that its own software drives, in tests of its sweep."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from analysis.direct.dynamic_stiffness import dynamic_stiffness
from analysis.direct.mains_hum import mains_beside
from daq import device
from rig.control import RunControl
from rig.events import Event
from rig.operator import Operator
from rig.sequences.sweep_plan import SweepPlan
from rig.sweep.driven_sweep import SinePoint
from rig.sweep.external_sweep import run_external_sweep
from rig.thermometer import Thermometer
from simlab.laboratory import Laboratory
from tests.channels import TESTER_CHANNELS
from tests.waiting import LONG

SPEED = 20.0
PLAN = SweepPlan(
    frequencies=(40.0, 50.0),
    amplitudes_pp=(1e-4, 3e-5),
    configurations=("shear",),
    specimens=("I",),
    mains_frequency=50,
)
DISPLACEMENT, FORCE = "cDAQ1Mod2/ai0", "cDAQ1Mod2/ai1"


@dataclass
class Watched(Operator):
    """Mounts specimens, starts the machine's own software, and notes what came of it."""

    laboratory: Laboratory
    accepts: Callable[[], bool] = lambda: False
    points: list[SinePoint] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)
    asked: list[int] = field(default_factory=list)
    tasks: list[str] = field(default_factory=list)
    offers: list[str] = field(default_factory=list)
    on_point: Callable[[], object] = int
    on_offer: Callable[[], object] = int

    def sweep(
        self,
        plan: SweepPlan = PLAN,
        completed: Sequence[int] = (),
        control: RunControl | None = None,
        patience: float = LONG,
    ) -> None:
        addresses = self.laboratory.addresses
        try:
            with (
                device.connect(addresses.daq) as chassis,
                chassis.record(TESTER_CHANNELS, 5120.0, 3.0) as recorder,
                Thermometer(addresses.thermometer) as thermometer,
            ):
                run_external_sweep(
                    plan, recorder, thermometer, self, self, self.events.append, control or RunControl(), completed,
                    patience,
                )  # fmt: skip
        finally:
            self.laboratory.program.rest()

    def strike(self, point: object, blow: int) -> None:
        raise AssertionError("a sweep has no blows")

    def mount(self, specimen: str, configuration: str) -> None:
        self.laboratory.bench.mount(specimen, configuration)

    def run_points(self, preset: float, points: Sequence[tuple[float, float]]) -> None:
        self.asked.append(len(points))
        if points:
            self.laboratory.program.run(preset, points)
        else:
            self.laboratory.program.rest()

    def do_task(self, text: str) -> None:
        self.tasks.append(text)
        self.laboratory.program.rest()

    def offer(self, text: str) -> Callable[[], bool]:
        self.offers.append(text)
        self.on_offer()
        return self.accepts

    def add_sine(self, point: SinePoint) -> None:
        self.points.append(point)
        self.on_point()

    def heard(self) -> str:
        return "\n".join(map(str, self.events))

    def wrong_points(self) -> list[str]:
        """What is wrong with the stored points, against the truth of all that the machine did."""
        wrong, log = list[str](), self.laboratory.tester.actuator.log
        for point in self.points:
            block, driven = point.block, point.driven_frequency
            tones = mains_beside(driven) if driven != point.frequency else ()
            found = dynamic_stiffness(
                block.value("displacement"), block.value("force"), block.sample_rate, driven, tones=tones
            )
            allowed = max(0.03, 4 * found.stiffness_estimate.standard_error / found.magnitude)
            near = [
                truth
                for truth in log
                if (truth.specimen, truth.configuration) == (point.specimen, point.configuration)
                and abs(truth.frequency / found.frequency - 1) < 1e-3
                and abs(truth.amplitude_pp / point.reached_pp - 1) < 0.04
            ]
            if not near:
                wrong.append(f"{point.order_number}: the machine never moved so")
            elif min(abs(found.complex_stiffness / complex(e.stiffness, e.damping) - 1) for e in near) > allowed:
                wrong.append(f"{point.order_number}: {found.complex_stiffness:g} N/m for {near[0].stiffness:g}")
            if abs(found.frequency / driven - 1) > 0.002 or abs(point.reached_pp / point.amplitude_pp - 1) > 0.1:
                wrong.append(f"{point.order_number}: {found.frequency:g} Hz, {point.reached_pp:g} m is another point")
        if len({point.order_number for point in self.points}) < len(self.points):
            wrong.append("a point was stored twice")
        return wrong
