"""Mass and stiffness of one beam element: a rod and a Timoshenko beam side by side, Eqs. (1)-(7).

All functions take the element length in m and phi, the ratio of bending to shear stiffness of
Eq. (4), and return (2, 2) or (4, 4) matrices in SI units. phi = 0 is a beam that is rigid in shear.
"""

import numpy as np

from analysis.frequency_response import Real

ROD = (0, 3)
"""Places of the two rod freedoms among the six of an element: x, y, rotation at either end."""
BENDING = (1, 2, 4, 5)
"""Places of the four bending freedoms: y and rotation at either end."""


def rod_stiffness(axial_stiffness: float, length: float) -> Real:
    """Eq. (1); `axial_stiffness` is EA in N."""
    return axial_stiffness / length * np.array([[1.0, -1.0], [-1.0, 1.0]])


def rod_mass(mass_per_length: float, length: float) -> Real:
    """Eq. (2); `mass_per_length` is rho A in kg/m."""
    return mass_per_length * length / 6 * np.array([[2.0, 1.0], [1.0, 2.0]])


def bending_stiffness(flexural_rigidity: float, length: float, phi: float) -> Real:
    """Eq. (3); `flexural_rigidity` is EI in N m^2."""
    near, far = (4 + phi) * length**2, (2 - phi) * length**2
    shape = np.array(
        [
            [12, 6 * length, -12, 6 * length],
            [6 * length, near, -6 * length, far],
            [-12, -6 * length, 12, -6 * length],
            [6 * length, far, -6 * length, near],
        ]
    )
    return np.asarray(flexural_rigidity / ((1 + phi) * length**3) * shape)


def translational_mass(mass_per_length: float, length: float, phi: float) -> Real:
    """Eq. (6), inertia of the transverse motion; `mass_per_length` is rho A in kg/m."""
    a = 70 * phi**2 + 147 * phi + 78
    b = (35 * phi**2 + 77 * phi + 44) * length / 4
    c = 35 * phi**2 + 63 * phi + 27
    d = (35 * phi**2 + 63 * phi + 26) * length / 4
    e = (7 * phi**2 + 14 * phi + 8) * length**2 / 4
    f = (7 * phi**2 + 14 * phi + 6) * length**2 / 4
    shape = np.array([[a, b, c, -d], [b, e, d, -f], [c, d, a, -b], [-d, -f, -b, e]])
    return np.asarray(mass_per_length * length / (210 * (1 + phi) ** 2) * shape)


def rotary_mass(rotary_inertia: float, length: float, phi: float) -> Real:
    """Eq. (7), inertia of the turning cross-section; `rotary_inertia` is rho I in kg m."""
    a = (15 * phi - 3) * length
    b = (10 * phi**2 + 5 * phi + 4) * length**2
    c = (5 * phi**2 - 5 * phi - 1) * length**2
    shape = np.array([[36, -a, -36, -a], [-a, b, a, c], [-36, a, 36, a], [-a, c, a, b]])
    return np.asarray(rotary_inertia / (30 * (1 + phi) ** 2 * length) * shape)


def rod_shape(place: float, length: float) -> Real:
    """(2, 2) shape functions of x at `place` in 0..1 of the element, and their derivatives along it, 1/m."""
    return np.array([[1 - place, place], [-1 / length, 1 / length]])


def transverse_shape(place: float, length: float, phi: float) -> Real:
    """(2, 4) shape functions of y at `place` in 0..1, and their derivatives, 1/m: those of Eq. (6)."""
    s = place
    values = [
        1 + phi - phi * s - 3 * s**2 + 2 * s**3,
        length * ((1 + phi / 2) * s - (2 + phi / 2) * s**2 + s**3),
        phi * s + 3 * s**2 - 2 * s**3,
        length * (-phi / 2 * s + (phi / 2 - 1) * s**2 + s**3),
    ]
    slopes = [
        (-phi - 6 * s + 6 * s**2) / length,
        1 + phi / 2 - (4 + phi) * s + 3 * s**2,
        (phi + 6 * s - 6 * s**2) / length,
        -phi / 2 + (phi - 2) * s + 3 * s**2,
    ]
    return np.array([values, slopes]) / (1 + phi)


def rotation_shape(place: float, length: float, phi: float) -> Real:
    """(2, 4) shape functions of the rotation at `place` in 0..1, and their derivatives, 1/m: those of Eq. (7)."""
    s = place
    bump, bump_slope = 6 * (s**2 - s) / length, 6 * (2 * s - 1) / length**2
    values = [bump, 1 + phi - (4 + phi) * s + 3 * s**2, -bump, 3 * s**2 - (2 - phi) * s]
    slopes = [bump_slope, (-(4 + phi) + 6 * s) / length, -bump_slope, (6 * s - (2 - phi)) / length]
    return np.array([values, slopes]) / (1 + phi)
