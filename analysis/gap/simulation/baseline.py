"""The paper's model of the bench, and the tolerances that the laboratory states for it.

A Timoshenko beam on lumped joints of two cylinders each, Eqs. (8)-(11), whose stiffness and structural damping depend
on neither amplitude nor frequency. Its unknowns are the cylinders, and all that is stated within a tolerance only.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from analysis.frequency_response import Real
from analysis.gap.bench import BeamBench, Cylinders, Mounting, Setting
from analysis.gap.effect import Given
from analysis.gap.measurement import Configuration, DrawnJoint, Measurement, TesterPoints
from analysis.gap.parameter import Parameter
from analysis.gap.simulation.scales import Scales, typical_scales

STIFFNESS_SPREAD = 1.0
"""Standard deviation of the prior of ln(stiffness) of a cylinder: only its order of magnitude is known."""
TYPICAL_LOSS, LOSS_SPREAD = 0.1, 0.7
"""Loss factors of filled rubber lie between 0.03 and 0.3 (D. I. G. Jones, Viscoelastic Vibration Damping, 2001)."""
TYPICAL_ROTATION = 20.0
"""N m, centre of the prior for the rotational stiffness c."""
MESH_TOLERANCE = 1e-4
"""Relative error of the squared third free frequency, which grows with that square: shear coefficients of the
literature (G. R. Cowper, J. Appl. Mech. 33, 1966) differ by 2 %, which is 5e-4 there. It is less, as effects such as a
contact patch change this frequency, too. The mesh is within 5e-5."""
STRAIGHT = np.array([[0.0, 1.0], [2.0, 0.0], [0.0, 0.0]])
"""Weights of shear and compression in the tester's reading, by configuration; angled pairs: `Baseline.weights`."""
IN_TESTER, GAIN = "set-up in the tester", "gain"
"""Names of parameters whose spread is in `Scales`; a joint, a configuration, or both follow in brackets."""
OF_CONFIGURATION, OF_MOUNTING = float(np.sqrt(0.5)), float(np.sqrt(0.5))
"""Parts of the scale of gains that all specimens share in a configuration, and that each has when it is mounted for it:
it is not known which part is larger."""
LEAN_IN_TESTER, SOFTENING_IN_TESTER = "lean in the tester", "softening in the tester"
"""Names of parameters: of each angled pair relative to its cylinders under the beam, and of all specimens per K."""
SOFTENING_SPREAD = 0.005
"""1/K, filled rubber softens by 0.3 to 1 % per K about room temperature (ISO 18437-4), where thermometers are right."""
LOCAL_COMPLIANCE = 5e-11
"""m/N, compliance of the beam between a blow and an accelerometer beside it. Beam theory does not contain it: shear
within a millimetre is 0.5e-11, what glue, stud and the surface under the hammer's tip add is not known."""


@dataclass(frozen=True, eq=False)
class Baseline:
    """The paper's model for one measurement.

    Attributes:
        measurement: of the bench that is modelled.
        shear, compression: (joints,) typical stiffness a and b, N/m, on which the priors are centred.
        scales: of the nuisances.
    """

    measurement: Measurement
    shear: Real
    compression: Real
    scales: Scales

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """Parameters of the cylinders of each joint, then of all that has a tolerance."""
        drawing, tolerances = self.measurement.drawing, self.measurement.tolerances
        found = list[Parameter]()
        for joint, a, b in zip(drawing.joints, self.shear, self.compression, strict=True):
            found += [
                Parameter(f"a({joint.name})", "N/m", float(a), STIFFNESS_SPREAD, positive=True),
                Parameter(f"b({joint.name})", "N/m", float(b), STIFFNESS_SPREAD, positive=True),
                Parameter(f"gamma_a({joint.name})", "1", TYPICAL_LOSS, LOSS_SPREAD, positive=True),
                Parameter(f"gamma_b({joint.name})", "1", TYPICAL_LOSS, LOSS_SPREAD, positive=True),
            ]
            found.append(Parameter(f"inclination({joint.name})", "rad", 0.0, tolerances.inclination))
            if self.measurement.sets:
                found += [
                    Parameter(f"c({joint.name})", "N m", TYPICAL_ROTATION, STIFFNESS_SPREAD, positive=True),
                    Parameter(f"position({joint.name})", "m", 0.0, tolerances.node_position),
                ]
        if self.measurement.sets:
            found += [
                Parameter("modulus", "1", 1.0, tolerances.youngs_modulus),
                Parameter("density", "1", 1.0, tolerances.density),
                Parameter("sensor position", "m", 0.0, tolerances.node_position),
                Parameter("mesh", "1", 0.0, MESH_TOLERANCE),
                Parameter("local compliance", "m/N", 0.0, LOCAL_COMPLIANCE),
            ]
        if self.measurement.points is not None:
            found.append(Parameter("tester gain", "1", 1.0, tolerances.tester_gain))
            scatter, gain = self.scales.setup_scatter, self.scales.configuration_gain
            found += [Parameter(f"{IN_TESTER}({joint.name})", "1", 1.0, scatter) for joint in drawing.joints]
            found += [Parameter(_gain(each), "1", 1.0, OF_CONFIGURATION * gain) for each in Configuration]
            for joint in drawing.joints:
                found += [Parameter(_gain(each, joint), "1", 1.0, OF_MOUNTING * gain) for each in Configuration]
            found += [
                Parameter(f"{LEAN_IN_TESTER}({joint.name})", "rad", 0.0, tolerances.inclination)
                for joint in drawing.joints
            ]
            found.append(Parameter(SOFTENING_IN_TESTER, "1/K", 0.0, SOFTENING_SPREAD))
        return tuple(found)

    def cylinders(self, given: Given) -> Cylinders:
        """Stiffness of all cylinders; in rotation a cylinder has the loss factor of compression."""
        storage, loss = [], []
        for joint in self.measurement.drawing.joints:
            name = joint.name
            gamma_a, gamma_b = given[f"gamma_a({name})"], given[f"gamma_b({name})"]
            a, b, c = given[f"a({name})"], given[f"b({name})"], given.get(f"c({name})", 0.0)
            storage.append([a, b, c])
            loss.append([a * gamma_a, b * gamma_b, c * gamma_b])
        return Cylinders(np.array(storage)[:, :, None, None], np.array(loss)[:, :, None, None])

    @cached_property
    def _drawn(self) -> Mounting:
        drawing = self.measurement.drawing
        nodes = np.array([drawing.node_positions[joint.node - 1] for joint in drawing.joints])
        return Mounting(
            inclination=np.array([joint.inclinations for joint in drawing.joints]),
            eccentricity=np.array([[-joint.eccentricity, joint.eccentricity] for joint in drawing.joints]),
            length=np.zeros(nodes.size),
            position=nodes,
        )

    def mounting(self, given: Given) -> Mounting:
        """The mounting as drawn, within tolerances; both cylinders of a joint lean with its frame."""
        drawn, names = self._drawn, [joint.name for joint in self.measurement.drawing.joints]
        return Mounting(
            inclination=drawn.inclination + np.array([[given[f"inclination({name})"]] for name in names]),
            eccentricity=drawn.eccentricity,
            length=drawn.length,
            position=drawn.position + np.array([given.get(f"position({name})", 0.0) for name in names]),
        )

    def beam(self, given: Given, setting: Setting, mounting: Mounting) -> BeamBench:
        """The beam rig in one hammer set, without the stiffness of its joints."""
        drawing = self.measurement.drawing
        rows = len(setting.inputs)
        driven = np.array([dof == drawing.accelerometer for dof in setting.inputs])
        pole = setting.decay + 2j * np.pi * setting.frequency
        return BeamBench(
            pole=np.asarray(pole, dtype=complex),
            joints=np.zeros((1, len(drawing.joints), 3, 3), dtype=complex),
            modulus=given["modulus"],
            density=given["density"],
            mesh=given["mesh"],
            loss=np.zeros(1),
            damping=1.0,
            ratio=0.0,
            joint_position=mounting.position,
            joint_reach=np.zeros(len(drawing.joints)),
            sensor_position=drawing.node_positions[drawing.accelerometer.node - 1] + given["sensor position"],
            sensor_height=0.0,
            sensor_mass=0.0,
            sensor_damping=0.0,
            cross_axis=0.0,
            blow_offset=np.zeros(rows),
            lean=np.zeros(rows),
            strike_height=0.0,
            chain=np.ones((1, 1), dtype=complex),
            added=(driven * given["local compliance"])[:, None].astype(complex),
            local=None,
            local_stiffness=np.zeros(1, dtype=complex),
            local_position=0.0,
            on_base=False,
            base=np.ones(1, dtype=complex),
        )

    def in_tester(self, given: Given, cylinders: Cylinders) -> Cylinders:
        """The cylinders, with the change of their stiffness by the set-up in the tester."""
        factor = np.array([given[f"{IN_TESTER}({joint.name})"] for joint in self.measurement.drawing.joints])
        return cylinders.scaled(factor[:, None, None, None], factor[:, None, None, None])

    def factor_in_tester(self, given: Given, points: TesterPoints) -> Real:
        """(points,) what the tester reads over the stiffness of the specimen.

        It is the gain in the configuration of each point, for the specimen as it is mounted there, and the softening
        from the mean temperature of all points to that of each.
        """
        gains = np.array([[given[alone] * given[mounted] for alone, mounted in each] for each in self._gains])
        gain = given["tester gain"] * gains[points.specimen, points.configuration]
        return np.asarray(gain * np.exp(-given[SOFTENING_IN_TESTER] * points.warmth))

    @cached_property
    def _gains(self) -> list[list[tuple[str, str]]]:
        """Names of both gains of each joint's specimen in each configuration."""
        joints = self.measurement.drawing.joints
        return [[(_gain(each), _gain(each, joint)) for each in Configuration] for joint in joints]

    def weights(self, given: Given, mounting: Mounting) -> Real:
        """(joints, configurations, 2) weights of shear and of compression in the tester's reading.

        An angled pair adds sin^2 theta of a and cos^2 theta of b from each side, which is a + b at 45 degrees. It is
        held by a block of the tester, and leans within the tolerance from where the cylinders are under the beam.
        """
        block = np.array([[given[f"{LEAN_IN_TESTER}({joint.name})"]] for joint in self.measurement.drawing.joints])
        lean = mounting.inclination + block
        found = np.tile(STRAIGHT, (len(lean), 1, 1))
        found[:, Configuration.ANGLED] = np.stack([np.sin(lean) ** 2, np.cos(lean) ** 2], axis=1).sum(axis=2)
        return found


def _gain(configuration: Configuration, joint: DrawnJoint | None = None) -> str:
    """Name of the gain of a configuration, or of a joint's specimen in it."""
    return f"{GAIN}({configuration.name.lower()}{f' {joint.name}' if joint else ''})"


def changed_by(kind: str) -> frozenset[str]:
    """Parts of the bench that a kind of parameter of the baseline changes: joints, surroundings, the specimens in the
    tester, or the factor of the tester's reading."""
    if kind in ("modulus", "density", "sensor position", "mesh", "local compliance", "position"):
        return frozenset({"surroundings"})
    if kind in ("tester gain", GAIN, SOFTENING_IN_TESTER):
        return frozenset({"factor"})
    if kind == "c":  # no specimen turns in the tester
        return frozenset({"joints"})
    return frozenset({"tester"} if kind in (IN_TESTER, LEAN_IN_TESTER) else {"joints", "tester"})


def baseline_of(measurement: Measurement) -> Baseline:
    """The model with priors centred on the tester's stiffness, or on a stiff joint where there is no tester."""
    joints = len(measurement.drawing.joints)
    typical = measurement.drawing.beam.flexural_rigidity / measurement.drawing.beam.length**3
    shear, compression = np.full(joints, 20 * typical), np.full(joints, 120 * typical)
    points = measurement.points
    if points is not None:
        for joint in range(joints):
            for found, configuration, share in (
                (shear, Configuration.SHEAR, 2.0),
                (compression, Configuration.COMPRESSION, 1.0),
            ):
                of = (points.specimen == joint) & (points.configuration == configuration)
                if np.any(of):
                    found[joint] = float(np.median(points.stiffness[of].real)) / share
    return Baseline(measurement, shear, compression, typical_scales(measurement.tolerances))
