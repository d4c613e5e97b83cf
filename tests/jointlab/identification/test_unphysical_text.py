"""Parts of a series that cannot be a stiffness are told with the line that fails most and what is wrong there."""

import pytest

from analysis.inverse.apparent_stiffness import Refusal, RefusedBand
from jointlab.identification.direct import UnphysicalPart
from jointlab.identification.unphysical_text import unphysical_text


@pytest.mark.parametrize(
    ("refusal", "value", "words"),
    [
        (Refusal.STORAGE, -2e5, "the storage stiffness at 80 Hz is -2e+05: a joint pushes back"),
        (Refusal.LOSS, -3e4, "the loss stiffness at 80 Hz is -3e+04: a joint feeds no energy"),
        (Refusal.RISE, 2.5, "about 80 Hz the stiffness rises as f^2.5: a joint rises as f at most"),
        (Refusal.FALL, -4.0, "about 80 Hz the stiffness falls as f^-4: inertia takes off more than half of it"),
        (Refusal.NARROW, 4, "4 lines: too narrow to be told from chance"),
    ],
)
def test_a_part_is_told_with_its_place_and_its_reason(refusal: Refusal, value: float, words: str) -> None:
    part = UnphysicalPart("shear", 0.05, RefusedBand(60.0, 95.0, refusal, 80.0, value))
    assert unphysical_text(part).startswith(f"shear, 0.05 mm, 60 to 95 Hz: {words}")
