"""Estimators of a frequency response from several blows."""

from enum import StrEnum


class Estimator(StrEnum):
    """How force and acceleration are averaged: H1 trusts the force, H2 the acceleration, HV neither more."""

    H1 = "H1"
    H2 = "H2"
    HV = "Hv"
