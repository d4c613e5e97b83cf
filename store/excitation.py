"""What excites a set of accelerances: a roving hammer, or a shaker that stays while the accelerometer roves."""

from __future__ import annotations

from typing import Literal

Excitation = Literal["hammer", "sine"]
HAMMER: Excitation = "hammer"
SINE: Excitation = "sine"
