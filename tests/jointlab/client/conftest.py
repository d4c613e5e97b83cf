"""The fixtures of the service: its client needs the same."""

from tests.api.conftest import laboratory, running_laboratory
from tests.api.service.conftest import acting, catalogue, make_key, rig, rig_client

__all__ = ["acting", "catalogue", "laboratory", "make_key", "rig", "rig_client", "running_laboratory"]
