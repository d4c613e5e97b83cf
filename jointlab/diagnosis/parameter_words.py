"""Parameters of effects in words, for tables that people read; data keep the names of the catalogue."""

import re
from collections.abc import Mapping

OF_EFFECT: Mapping[str, Mapping[str, str]] = {
    "accelerometer_mass": {"m": "mass of the accelerometer beyond the stated one", "c": "damping by the cable"},
    "amplitude_dependence": {
        "k0_over_kinf": "stiffness at rest over that at large amplitudes",
        "xc": "amplitude in the middle of the fall",
        "m": "exponent of the fall",
        "loss_peak": "height of the peak of loss",
        "loss_follows": "fall of loss stiffness over that of stiffness",
    },
    "attachment": {
        r"real_(.+)": "stiffness added at {0} Hz, over the joint's",
        r"imaginary_(.+)": "loss added at {0} Hz, over the joint's stiffness",
    },
    "beam": {r"modulus_(.+)": "modulus at {0} Hz, less one", r"loss_(.+)": "loss factor more at {0} Hz"},
    "beam_damping": {
        "eta": "loss factor of the free beam",
        "power": "power of frequency that it follows",
        r"log_share_(.+)": "logarithm of its ratio at {0} Hz",
    },
    "blow": {r"lean_(.+)_deg": "lean of blows at {0}", r"shift_(.+)": "distance of blows from the mark {0}"},
    "channel_delay": {
        "tau": "delay of the acceleration after the force",
        r"more_(.+)": "more of it at {0} Hz, as a share",
    },
    "conditioning_drift": {
        "d": "share of stiffness lost over the test",
        "under_beam": "share of the drift that is over under the beam",
        "knee": "share of the test after which most of it is over",
        r"faster_to_(.+)": "change of the logarithm of its rate up to {0} of the test",
    },
    "contact_patch": {
        "length": "length of the beam that a joint holds",
        r"aside_(.+)": "offset at joint {0}, over the length",
    },
    "coulomb_friction": {
        "F_c": "friction force",
        "slip": "displacement at which it slips",
        "share": "share of stiffness that sticks",
        "spread": "spread of the displacements at which sliders slip, in natural logarithms",
    },
    "cross_axis_sensitivity": {"sensitivity": "share of the axial motion that the accelerometer reads"},
    "cubic_stiffness": {"beta": "change of stiffness per square of amplitude", "x_s": "amplitude where it levels off"},
    "cylinder_angle": {
        "delta_deg": "how much steeper the cylinders lean than drawn",
        "splay_deg": "difference of the two cylinders",
    },
    "density": {"relative": "density over the stated one, less one"},
    "double_hit": {"ratio": "second hit over the first"},
    "exponential_window": {"s": "decay of the exponential window that is not corrected"},
    "fixture_inertia": {"m": "mass between specimen and force transducer"},
    "foundation_compliance": {
        "f": "resonance of the foundation",
        "k_f": "stiffness of the foundation",
        "eta": "loss factor of the foundation",
        "f_second": "second resonance of the foundation",
        "second_over_first": "compliance of the second mode over that of the first",
        "eta_second": "loss factor of the second mode",
    },
    "frame_compliance": {"c": "compliance of the tester's frame", "loss": "loss factor of the frame"},
    "frame_resonance": {
        "f_r": "resonance of the tester's frame",
        "zeta": "damping ratio of the frame",
        "share": "share of this mode",
        "second_over_first": "frequency of the next mode over that of this one",
    },
    "frequency_dependence": {
        r"g_(.+)": "strength of relaxation {0}",
        r"f_(.+)": "frequency of relaxation {0}",
        "ratio": "stiffness far above over that far below the middle",
        "f": "frequency in the middle",
        "alpha": "fractional order",
        "g": "strength at 100 Hz",
    },
    "highpass_corner": {
        "corner": "corner frequency of the acceleration channel",
        "second": "second corner over the first",
    },
    "impact_angle": {"angle_deg": "lean of the blows", r"more_at_(.+)_deg": "more of it at {0}"},
    "impact_position": {r"shift_(.+)": "distance of the blows from mark {0}, positive to the right"},
    "joint_frequency": {
        r"storage_(.+)": "logarithm of stiffness at {0} Hz, over that at 50 Hz",
        r"loss_(.+)": "logarithm of loss at {0} Hz, over that at 50 Hz",
    },
    "joint_geometry": {r"(k\d\d)_(.+)": "change of {0} of joint {1}, over its direct terms"},
    "joint_mass": {
        "m": "mass of caps and bolts at each joint",
        r"m_(.+)": "mass of caps and bolts at joint {0}",
        "gyration_squared": "square of the radius of gyration",
        r"aside_(.+)": "its distance from joint {0} along the beam",
        "along": "mass that moves along the beam over that across it",
    },
    "joint_state": {
        r"storage_(.+)": "logarithm of stiffness of the tester over the beam, {0}",
        r"loss_(.+)": "logarithm of loss of the tester over the beam, {0}",
        r"drift_(.+)": "logarithm of stiffness after {0} of the test",
    },
    "loss_law": {
        "p": "power of frequency",
        r"p_(.+)": "power of frequency, {0}",
        r"q_(.+)": "viscous share at 100 Hz, {0}",
        r"(shear|compression)_(.+)": "logarithm of the ratio to the power at {1} Hz, {0}",
    },
    "mains_hum": {"amplitude": "amplitude of the hum"},
    "measuring_chain": {
        r"gain_(.+)": "logarithm of gain at {0} Hz",
        r"phase_(.+)": "phase in rad at {0} Hz",
        "leak": "share of axial motion that is read",
    },
    "mesh_error": {"third_mode": "squared frequency of the third free mode, simulated over true, less one"},
    "out_of_plane_bending": {
        "coupling": "coupling of the bending out of the plane",
        "leak": "the same from blows across the beam, over those along it",
        r"f_rigid_(\d)": "frequency of rigid mode {0}",
        r"eta_rigid_(\d)": "loss factor of rigid mode {0}",
        r"f_(\d)": "frequency of mode {0}",
        r"eta_(\d)": "loss factor of mode {0}",
        "second_over_first": "size of the second mode over that expected beside the first",
        "first_over_free": "size of the first mode over that of a free beam",
        r"lean_(.+)": "more coupling of blows at {0}",
        r"row_(.+)_(\d)": "more of mode {1} in the row of {0}, as a share",
        "elasticity": "square of frequencies over the drawn one's",
        "eta": "loss factor of this bending",
        "shear": "shear stiffness of joints over the typical one",
        "gamma": "loss factor of joints in this shear",
    },
    "preload_stiffening": {
        "s": "growth of stiffness per mm of the tester's preset",
        "shear_when_angled": "growth in shear over that in compression at 45 degrees",
    },
    "sensor_gain": {
        "gain": "gain of the accelerances over the true one, less one",
        r"uneven_(.+)": "logarithm of more gain at {0} Hz",
    },
    "support_position": {r"dx_(.+)": "distance of joint {0} from its drawn place, positive to the right"},
    "temperature_shift": {
        "delta_t": "temperature of the beam less that of the tester",
        "loss_ratio": "change of loss over that of stiffness",
        "softening": "stiffness lost per kelvin at 60 Hz",
        r"slope_(.+)": "softening at {0} Hz over that at 60 Hz, less one",
        r"more_slope_(.+)": "what a bend adds to that of {0} Hz",
    },
    "tester": {
        r"gain_([a-z]+)_(.+)": "logarithm of gain at {1} Hz, {0}",
        r"phase_([a-z]+)_(.+)": "phase in rad at {1} Hz, {0}",
    },
    "transducer_lag": {
        "tau": "time by which the force leads the displacement",
        r"more_(.+)": "more of it at {0} Hz, as a share",
    },
    "vertical_offset": {r"shift_(.+)": "distance of the cylinders of joint {0} from the beam's axis"},
    "youngs_modulus": {"relative": "modulus over the stated one, less one"},
}
"""Words of each effect's own parameters by a pattern of their names; numbers in braces stand for its groups."""
SHARED: Mapping[str, str] = {
    "motion": "motion under blows over the computed one",
    "by_force": "power with which motion follows the level of blows",
    "by_row": "how far each blow has its own motion, 0 to 1",
    "by_joint": "how far each joint has its own motion, 0 to 1",
    "fall": "power of frequency with which motion falls",
    "height": "height of the sensor's element above the axis",
    "shear_share": "effect in shear over that in compression",
    "loss_share": "growth of loss over that of stiffness",
    r"more_(storage|loss)_at_um_(.+)": "more change of {0} at {1} µm than by the law, as a share",
    r"more_(storage|loss)_in_shear": "more change of {0} in shear, as a share",
    r"share_(.+)": "share of {0}",
}
"""Words of parameters that several effects have."""


def words_of(effect: str, name: str) -> str | None:
    """A parameter in words, as "friction force"; None where there are none."""
    for pattern, words in (*OF_EFFECT.get(effect, {}).items(), *SHARED.items()):
        found = re.fullmatch(pattern, name)
        if found is not None:
            return words.format(*found.groups())
    return None


def parameter_words(effect: str, name: str) -> str:
    """A parameter in words with its name, as "friction force (F_c)"; its name alone where there are none."""
    words = words_of(effect, name)
    return name if words is None else f"{words} ({name})"
