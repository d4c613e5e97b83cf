"""Readings of instruments in words, for the people who read them; data and commands have their ids."""

WORDS = {
    "temperature_shift.delta_t": "temperature of the beam less that of the tester",
    "support_position.dx": "distance of a joint from its drawn place, positive to the right",
    "impact_position.shift": "distance of the blows from their mark, positive to the right",
    "accelerometer_mass.m": "mass of the accelerometer beyond the stated one",
    "joint_mass.m": "mass of caps and bolts at a joint",
    "density.relative": "density over the stated one, less 1",
    "cylinder_angle.delta_deg": "how much steeper the cylinders lean than drawn",
    "vertical_offset.shift": "distance of the cylinders from the beam's axis",
    "contact_patch.length": "length of the beam that a joint holds",
    "sensor_gain.gain": "gain of the accelerances over the true one, less 1",
    "channel_delay.tau": "delay of the acceleration against the force",
    "highpass_corner.corner": "corner frequency of the acceleration channel",
    "frame_compliance.c": "compliance of the tester's frame",
    "frame_resonance.f_r": "resonance of the tester's frame",
    "fixture_inertia.m": "mass between specimen and force transducer",
    "transducer_lag.tau": "time by which the force leads the displacement",
    "exponential_window.s": "decay of the exponential window that is not corrected",
    "preload_stiffening.s": "growth of the stiffness with the tester's preset",
    "cross_axis_sensitivity.sensitivity": "share of the axial motion that the accelerometer reads",
    "out_of_plane_bending.coupling": "coupling of the bending out of the plane",
    "impact_angle.angle_deg": "lean of the blows",
    "youngs_modulus.relative": "Young's modulus over the stated one, less 1",
    "beam_damping.eta": "loss factor of the free beam",
    "mesh_error.third_mode": "squared frequency of the third free mode, simulated over measured, less 1",
    "foundation_compliance.k_f": "stiffness of the foundation",
}
"""Words by effect and parameter. A parameter that each joint or point has for itself ends with its name."""
AT_POINTS = ("impact_position", "impact_angle")
"""Effects whose parameters are of points; those of others are of joints."""
UNITS = {"1": "a ratio", "deg": "°"}
"""Units as people write them, where the data have them otherwise."""


def reading_words(name: str) -> str:
    """A reading in words; its name where there are none for it.

    Args:
        name: effect and parameter, joined by a point, such as channel_delay.tau or joint_mass.m_II.
    """
    if name in WORDS:
        return WORDS[name]
    known = next((each for each in WORDS if name.startswith(f"{each}_")), None)
    if known is None:
        return name
    place = "point" if name.startswith(AT_POINTS) else "joint"
    return f"{WORDS[known]}, {place} {name.removeprefix(f'{known}_')}"


def unit_words(unit: str) -> str:
    """A unit as people write it."""
    return UNITS.get(unit, unit)


def reading_label(name: str, unit: str) -> str:
    """A reading in words with its unit in brackets."""
    return f"{reading_words(name)} ({unit_words(unit)})"
