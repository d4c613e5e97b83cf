"""Options of an identification, declared once: command line, REST, client, jobs and stored settings follow from here.

This module imports no numerical package, because `jointlab identify --help` and the client need it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

from analysis.inverse.frequency_law import FrequencyLaw
from analysis.modal.estimator import Estimator
from store.exchange.blow_window import BlowWindow
from store.quantity import quantity

SWITCHES = ("transducer_lag", "frame_compliance", "fixture_inertia", "temperature_shift")
"""Names of the corrections of sine points that can be switched off."""
LARGEST_RUN = 2**31 - 1
"""An integer that every database can hold."""
LONGEST_WINDOW = 100.0  # s


class Options(BaseModel):
    """Options; by default everything is as the measurement itself has it."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    without: Annotated[
        tuple[str, ...], Field(description=f"corrections of the sine points to leave out: {', '.join(SWITCHES)}")
    ] = ()
    free_beam: Annotated[
        int | None,
        Field(
            ge=1,
            le=LARGEST_RUN,
            description="run on the suspended beam, whose damping, modulus and density the beam then has, with their "
            "errors",
        ),
    ] = None
    elements: Annotated[
        int | None,
        Field(
            ge=1,
            le=32,
            description="elements of the beam between neighbouring nodes; 1 is the paper's mesh, by default it is "
            "converged",
        ),
    ] = None
    joint_law: Annotated[
        FrequencyLaw,
        Field(
            description="law of frequency that joints follow: constant, a power, or a fractional Zener model (zener); "
            "auto takes the one of most evidence"
        ),
    ] = FrequencyLaw.AUTO
    regularise: Annotated[
        float | None,
        quantity(
            "1",
            "share of its size within which every term of the joints is held about the paper's method; by default no "
            "term is held",
            ge=0.01,
            le=10,
        ),
    ] = None
    estimator: Annotated[
        Estimator,
        Field(
            description="how blows are averaged: H1 trusts the force, H2 the acceleration, Hv trusts both alike; local "
            "is H1 of records that are cut while the beam still rings, without what their ends add"
        ),
    ] = Estimator.H1
    force_window: Annotated[
        float | None,
        quantity("s", "time after the trigger of a blow from which force is set to zero", ge=1e-4, le=LONGEST_WINDOW),
    ] = None
    exponential_window: Annotated[
        float | None,
        quantity(
            "s",
            "time constant of an exponential window on force and acceleration of every blow; the damping that it adds "
            "is taken out of modes and joints",
            ge=0.01,  # modes are seen through it
            le=LONGEST_WINDOW,
        ),
    ] = None

    @property
    def window(self) -> BlowWindow:
        """The window on the records of blows."""
        return BlowWindow(self.force_window, self.exponential_window)

    @property
    def averages_otherwise(self) -> bool:
        """Whether blows are to be averaged in another way than the default one."""
        return (self.estimator, self.window) != (AS_MEASURED.estimator, AS_MEASURED.window)

    def settings(self, free_beam: int | None) -> dict[str, Any]:
        """The options as they are stored with an analysis.

        Args:
            free_beam: the run whose suspended test was used, also where it is the run's own.
        """
        window = {"force_seconds": self.force_window, "time_constant": self.exponential_window}
        stored = self.model_dump(mode="json", include={"without", "elements", "joint_law", "regularise"})
        return stored | {"averaging": {"estimator": self.estimator.value, "window": window}, "free_beam": free_beam}

    @classmethod
    def of_settings(cls, stored: Mapping[str, Any]) -> Options:
        """The options from `settings`; options that an older version did not store have their defaults.

        That version had joints constant, or following a power of frequency within `joint_exponent`.
        """
        averaging = stored.get("averaging", {})
        window = averaging.get("window", {})
        chosen = {name: value for name, value in stored.items() if name not in ("averaging", "joint_exponent")}
        if "joint_exponent" in stored:
            chosen["joint_law"] = FrequencyLaw.POWER if stored["joint_exponent"] else FrequencyLaw.CONSTANT
        return cls(
            **chosen,
            estimator=averaging.get("estimator", Estimator.H1),
            force_window=window.get("force_seconds"),
            exponential_window=window.get("time_constant"),
        )


AS_MEASURED = Options()
"""All options at their defaults."""
