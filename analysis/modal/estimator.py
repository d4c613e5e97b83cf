"""Estimators of a frequency response from several blows."""

from enum import StrEnum


class Estimator(StrEnum):
    """How force and acceleration are averaged: H1 trusts the force, H2 the acceleration, HV neither more.

    LOCAL is H1 without what the cut end of each record adds, which a model of the lines around each line tells.
    """

    H1 = "H1"
    H2 = "H2"
    HV = "Hv"
    LOCAL = "local"
