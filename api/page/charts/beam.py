"""The beam as it stands on its joints, with the points that are struck: done, next and still to do."""

from collections.abc import Mapping, Sequence
from html import escape

WIDTH, HEIGHT, MARGIN, AXIS = 1000.0, 230.0, 80.0, 118.0
NEXT, DONE, TO_DO = "#e69f00", "#0072b2", "#ffffff"


def beam_drawing(
    positions: Sequence[float],
    joints: Mapping[str, int],
    accelerometer: str,
    counts: Mapping[str, tuple[int, int]],
    following: str | None,
) -> str:
    """The drawing as SVG.

    Args:
        positions: of the nodes along the beam, m.
        joints: node by name.
        accelerometer: where it sits, such as 3y.
        counts: for each point struck, accepted blows and how many are wanted.
        following: the point to strike next, which is lit; None where nothing is.
    """
    said = f"strike {following} next" if following else "nothing to strike now"
    parts = [
        f'<svg viewBox="0 0 {WIDTH:g} {HEIGHT:g}" width="100%" role="img" aria-label="the beam; {said}">',
        f'<rect x="{MARGIN}" y="{AXIS - 9}" width="{WIDTH - 2 * MARGIN}" height="18" fill="#c9cdd2" stroke="#444"/>',
    ]
    for name, node in joints.items():
        parts.append(_joint(_x(positions, node), name))
    parts.append(_accelerometer(_x(positions, int(accelerometer[:-1]))))
    parts += [_point(positions, point, *count, point == following) for point, count in counts.items()]
    return "".join(parts) + "</svg>"


def _x(positions: Sequence[float], node: int) -> float:
    return MARGIN + (WIDTH - 2 * MARGIN) * positions[node - 1] / positions[-1]


def _joint(x: float, name: str) -> str:
    """Two inclined cylinders under the beam, and their ground."""
    legs = "".join(
        f'<rect x="-9" y="0" width="18" height="40" fill="#8a8f95" stroke="#444" transform="translate({x} {AXIS + 9}) '
        f'rotate({angle})"/>'
        for angle in (-38, 38)
    )
    return (
        f'{legs}<path d="M{x - 48} {AXIS + 46}h96" stroke="#444" stroke-width="4"/>'
        f'<text x="{x}" y="{AXIS + 72}" text-anchor="middle" font-size="20">joint {escape(name)}</text>'
    )


def _accelerometer(x: float) -> str:
    return (
        f'<path d="M{x} {AXIS + 24}V{AXIS + 84}" stroke="#222"/>'
        f'<rect x="{x - 8}" y="{AXIS + 10}" width="16" height="14" fill="#009e73" stroke="#222"/>'
        f'<text x="{x}" y="{AXIS + 100}" text-anchor="middle" font-size="16">accelerometer</text>'
    )


def _point(positions: Sequence[float], point: str, accepted: int, wanted: int, lit: bool) -> str:
    x, node = _x(positions, int(point[:-1])), int(point[:-1])
    across = point.endswith("y")
    outward = -1 if node == 1 else 1
    cx, cy = (x, AXIS - 34) if across else (x + outward * 40, AXIS)
    fill = NEXT if lit else DONE if accepted >= wanted else TO_DO
    ink = "#fff" if fill == DONE else "#111"
    size = 27 if lit else 20
    arrow = f"M{cx} {cy + size}V{AXIS - 10}" if across else f"M{cx - outward * size} {cy}H{x + outward * 2}"
    ring = f'<circle cx="{cx}" cy="{cy}" r="{size + 6}" fill="none" stroke="#d55e00" stroke-width="5"/>' if lit else ""
    label_y = cy - size - 12 if across else cy + size + 24
    return (
        f'<g data-point="{point}" data-next="{str(lit).lower()}">{ring}<path d="{arrow}" stroke="#222" '
        f'stroke-width="2.5"/><circle cx="{cx}" cy="{cy}" r="{size}" fill="{fill}" stroke="#222" stroke-width="2"/>'
        f'<text x="{cx}" y="{cy + 7}" text-anchor="middle" font-size="{19 if len(point) < 3 else 16}" '
        f'font-weight="700" fill="{ink}">{point}</text>'
        f'<text x="{cx}" y="{label_y}" text-anchor="middle" font-size="17">{accepted}/{wanted}</text></g>'
    )
