"""Parts of a series of sine points that cannot be a specimen's stiffness, in words."""

from analysis.inverse.apparent_stiffness import Refusal, RefusedBand
from jointlab.identification.direct import UnphysicalPart


def unphysical_text(part: UnphysicalPart) -> str:
    """Which points, and why they cannot be a stiffness."""
    band = part.band
    where = f"{part.configuration}, {part.amplitude_pp:g} mm, {band.lowest:g} to {band.highest:g} Hz"
    return f"{where}: {_why(band)}"


def _why(band: RefusedBand) -> str:
    match band.refusal:
        case Refusal.STORAGE:
            return f"the storage stiffness at {band.worst:.4g} Hz is {band.value:.3g}: a joint pushes back"
        case Refusal.LOSS:
            return f"the loss stiffness at {band.worst:.4g} Hz is {band.value:.3g}: a joint feeds no energy"
        case Refusal.RISE:
            rises = f"about {band.worst:.4g} Hz the stiffness rises as f^{band.value:.2g}"
            return f"{rises}: a joint rises as f at most, a resonance does"
        case Refusal.FALL:
            falls = f"about {band.worst:.4g} Hz the stiffness falls as f^{band.value:.2g}"
            return f"{falls}: inertia takes off more than half of it, or a resonance is near"
        case Refusal.NARROW:
            return f"{band.value:.0f} lines: too narrow to be told from chance"
