"""The document of a handmade diagnosis, for answers that are judged."""

from tests.jointlab.diagnosis.conftest import document

__all__ = ["document"]
