"""Conditions of an experiment that further data may lack; a file of its own, as clients read it without numpy."""

from enum import StrEnum


class MissingCondition(StrEnum):
    """A condition that was not kept; the value is its id in documents."""

    HAMMER_SET = "hammer_set"
    TESTER_POINTS = "tester_points"
    POINTS = "points"
    FORCE = "force"
    HIGHEST_LINE = "highest_line"
    MOUNTINGS = "mountings"
    AMPLITUDE = "amplitude"
    LOWEST_FREQUENCY = "lowest_frequency"
    HIGHEST_FREQUENCY = "highest_frequency"
    RANDOM_ORDER = "random_order"
