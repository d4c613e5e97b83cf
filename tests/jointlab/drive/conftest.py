"""The fixtures of the service: its run manager needs the same."""

from tests.api.service.conftest import catalogue, rig

__all__ = ["catalogue", "rig"]
