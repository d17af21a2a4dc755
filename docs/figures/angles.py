"""Drawing of the angles θ1, θ2, θ3: a limb that stands on a joint, turned by one after the other.

`make figures` runs this script. With the argument `-` it prints the drawing.
"""

import sys
from pathlib import Path

import numpy as np
from elements import Point, arrow, dot, path, text, whole

from rbstab.mechanics.attitude import rotation

PICTURE = Path(__file__).parents[1] / "pictures" / "angles.svg"
WIDTH, HEIGHT = 760, 290
TITLE = "A limb turned by θ1 about x, then by θ2 about the new y, then by θ3 about the new z"

ANGLES = np.array([0.5, 0.42, 0.95])
HALF, LONG = np.array([0.16, 0.1]), 1.0
"""Half the sides of the limb across, and its length above the joint."""

TURN, RISE = np.radians(34.0), np.radians(20.0)
VIEW = np.array(
    [
        [np.cos(TURN), np.sin(TURN), 0.0],
        [-np.sin(TURN) * np.sin(RISE), np.cos(TURN) * np.sin(RISE), np.cos(RISE)],
        [np.sin(TURN) * np.cos(RISE), -np.cos(TURN) * np.cos(RISE), np.sin(RISE)],
    ]
)
"""Rows: the directions to the right, up, and to the reader."""

PANELS = (
    ("θ1 about x", "flexion, extension", (2, 1.15)),
    ("then θ2 about the new y", "abduction, adduction", (2, 1.15)),
    ("then θ3 about the new z", "internal, external rotation", (0, 0.45)),
)
"""What stands below each panel, and the axis whose tip draws the arc, with its distance."""


def limb(A: np.ndarray, put: np.ndarray, kind: str) -> str:
    """Draw the faces of the limb that the reader sees."""
    drawn = []
    for axis in range(3):
        for side in (-1.0, 1.0):
            if side * (VIEW @ A)[2, axis] <= 0:
                continue
            others = [i for i in range(3) if i != axis]
            corners = []
            for a, b in ((-1, -1), (-1, 1), (1, 1), (1, -1), (-1, -1)):
                sign = np.zeros(3)
                sign[[axis, *others]] = side, a, b
                corner = np.array([*(sign[:2] * HALF), LONG * (sign[2] + 1) / 2])
                corners.append(on_paper(A @ corner, put))
            drawn.append(path(corners, kind))
    return "".join(drawn)


def on_paper(point: np.ndarray, joint: np.ndarray) -> Point:
    """Return where a point is drawn, in pixels."""
    right, up, _ = VIEW @ point
    return float(joint[0] + 128 * right), float(joint[1] - 128 * up)


def turned(number: int, part: float) -> np.ndarray:
    """Return the rotation after the first turns, and a part of the next one."""
    return rotation(ANGLES * np.array([*np.ones(number), part, 0.0, 0.0])[:3])


def panel(number: int) -> str:
    """Draw the limb before and after one of the three turns."""
    joint = np.array([120.0 + 250 * number, 186.0])
    after, (caption, meaning, (axis, far)) = turned(number, 1.0), PANELS[number]
    parts = np.linspace(0.0, 1.0, 16)
    arc = [on_paper(far * turned(number, part)[:, axis], joint) for part in parts]
    drawn = [limb(turned(number, 0.0), joint, "dash"), limb(after, joint, "body")]
    for direction, name, size in zip(after.T, "xyz", (0.6, 0.7, 1.3), strict=True):
        tip = on_paper(size * direction, joint)
        drawn += [
            arrow((joint[0], joint[1]), tip, "blue", "bluehead", 9),
            text(on_paper((size + 0.1) * direction, joint), name, "symbol blue-text"),
        ]
    return "".join(
        [
            *drawn,
            path(arc[:-1], "force"),
            arrow(arc[-3], arc[-1], "force", "forcehead", 12),
            dot((joint[0], joint[1]), 5),
            text((joint[0], 254), caption, "force-text"),
            text((joint[0], 273), meaning, "small"),
        ]
    )


def drawing() -> str:
    """Return the whole SVG file."""
    content = "".join(panel(number) for number in range(3))
    return whole(content, WIDTH, HEIGHT, TITLE)


if __name__ == "__main__":
    if sys.argv[1:] == ["-"]:
        sys.stdout.write(drawing())
    else:
        PICTURE.write_text(drawing(), encoding="utf-8")
