"""The fixtures of the service: its client needs the same."""

from tests.api.service.conftest import acting, catalogue, make_key, rig, rig_client, rig_settings

__all__ = ["acting", "catalogue", "make_key", "rig", "rig_client", "rig_settings"]
