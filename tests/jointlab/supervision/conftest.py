"""The fixtures of the service: its run manager needs the same."""

from tests.api.service.conftest import acting, catalogue, impatient, make_key, rig, rig_client, rig_settings

__all__ = ["acting", "catalogue", "impatient", "make_key", "rig", "rig_client", "rig_settings"]
