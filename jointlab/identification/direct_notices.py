"""What speaks against the tester's results for one joint, one sentence each: every way in shows the same ones."""

from analysis.inverse.apparent_stiffness import Refusal, RefusedBand
from jointlab.identification.direct import Direct, UnphysicalPart

CONTRADICTED = "not reliable"
"""Beside each interval of a joint whose configurations contradict each other."""


def direct_notices(name: str, found: Direct) -> tuple[str, ...]:
    """Sentences on the points of joint `name`, the worst first; empty where nothing speaks against them."""
    return (
        *_contradiction(name, found),
        *(f"Not a specimen's stiffness: joint {name}, {unphysical_text(part)}." for part in found.unphysical),
        *(f"In no law and no comparison: joint {name}, {text}." for text in found.left_out),
        *(
            f"Joint {name}: the {point.configuration} point at {1e3 * point.amplitude_pp:.3g} mm, "
            f"{point.frequency:g} Hz contradicts the other configurations and the points beside it; measure it again."
            for point in found.wrong_points
        ),
        *_scatter(name, found),
        *_distortion(name, found),
    )


def _contradiction(name: str, found: Direct) -> list[str]:
    notices = []
    refuted, tested = found.refuted
    if found.contradicted:
        notices.append(
            f"Joint {name}: compression, shear and angled contradict each other, typically by "
            f"{100 * found.contradiction:.0f} % of the softer term, and superposition is refuted at {refuted} of "
            f"{tested} points. Do not rely on a, b or the joint: check units, number of cylinders, amplitudes and "
            "phases in each configuration."
        )
    elif refuted:
        notices.append(f"Joint {name}: superposition is refuted at {refuted} of {tested} points.")
    if found.compression_is_softer:
        notices.append(
            f"Joint {name}: most cylinders are softer in compression than in shear, which no rubber cylinder is; "
            "are the two exchanged?"
        )
    return notices


def _scatter(name: str, found: Direct) -> list[str]:
    if found.scatter == 1 or found.contradicted:
        return []
    return [
        f"Joint {name}: compression, shear and angled differ {found.scatter:.3g} times as much as the stated errors of "
        "their points allow; all intervals are wider by this factor."
    ]


def _distortion(name: str, found: Direct) -> list[str]:
    insufficient, count = found.insufficient
    if not insufficient:
        return []
    return [
        f"Joint {name}: the first harmonic does not describe {len(insufficient)} of {count} points, the first because "
        f"{insufficient[0].shortcomings[0]}."
    ]


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
            return f"{band.value:.0f} lines: too narrow to be distinguished from chance"
