"""The views of the page, one a file: each builds itself into a frame from what the address asks for."""

from api.page.views import alarms, dashboard, gap, hall, hammer, instruments, laboratory, measure, results, runs, sweep

__all__ = [
    "alarms",
    "dashboard",
    "gap",
    "hall",
    "hammer",
    "instruments",
    "laboratory",
    "measure",
    "results",
    "runs",
    "sweep",
]
