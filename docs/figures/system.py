"""Drawing of the system: body, centre of gravity, contact point, anchor, connector, stabilizers.

`make figures` runs this script. With the argument `-` it prints the drawing.
"""

import sys
from pathlib import Path

import numpy as np
from elements import along, arrow, box, coil, damper, dot, ground, path, text, whole

PICTURE = Path(__file__).parents[1] / "pictures" / "system.svg"
WIDTH, HEIGHT = 760, 400
TITLE = (
    "A rigid body, its stabilizers at the centre of gravity, and a connector at the contact point"
)

CENTRE, CONTACT, ANCHOR = (392.0, 158.0), (458.0, 196.0), (612.0, 288.0)


def stabilizers() -> str:
    """Draw the spring and damper to the origin, and the couple that turns the body upright."""
    wall = (70.0, CENTRE[1])
    turn = [
        (CENTRE[0] + 46 * np.cos(a), CENTRE[1] - 46 * np.sin(a)) for a in np.linspace(2.6, 0.75, 24)
    ]
    return "".join(
        [
            ground((70, 218), (70, 98)),
            coil(wall, CENTRE, -14),
            damper(wall, CENTRE, 16),
            path(turn[:-2], "force"),
            arrow(turn[-4], turn[-1], "force", "forcehead", 13),
            text((100, 98), "translational stabilizer", "part-text", "start"),
            text((100, 118), "K_t, L_t", "part-text", "start"),
            text((88, 206), "pulls the centre of gravity", "small", "start"),
            text((88, 223), "to the origin, along every axis", "small", "start"),
            text((448, 50), "rotational stabilizer K_r, L_r", "force-text", "start"),
            text((448, 68), "turns the body to Θ = 0", "small", "start"),
            path([(442, 56), (424, 112)], "thin"),
        ]
    )


def connector() -> str:
    """Draw the connector between the contact point and its anchor, and the displacement E."""
    whole = float(np.hypot(*np.subtract(ANCHOR, CONTACT)))
    shifted = along(CONTACT, ANCHOR, [(8, -40), (whole, -40)])
    return "".join(
        [
            coil(CONTACT, ANCHOR, -13, 5),
            damper(CONTACT, ANCHOR, 15),
            path([shifted[0], along(CONTACT, ANCHOR, [(0, -8)])[0]], "dash"),
            path([shifted[1], along(CONTACT, ANCHOR, [(whole, -8)])[0]], "dash"),
            arrow(shifted[1], shifted[0], "blue", "bluehead"),
            ground((672, 300), (552, 300)),
            path([ANCHOR, (ANCHOR[0], 300)], "line"),
            dot(ANCHOR),
            text((582, 206), "E", "symbol blue-text"),
            text((596, 206), "C from its anchor", "blue-text", "start"),
            text((632, 290), "anchor", anchor="start"),
            text((438, 286), "connector", "part-text"),
            text((438, 306), "K_c, L_c", "part-text"),
            text((440, 326), "ties C to the anchor, or C is", "small"),
            text((440, 343), "held there, slides, or is free", "small"),
        ]
    )


def body() -> str:
    """Draw the body with its centre of gravity, its contact point and its weight."""
    return "".join(
        [
            box(CENTRE, -14, (190, 132)),
            arrow(CENTRE, CONTACT, "dash", "head"),
            arrow(CENTRE, (CENTRE[0], 268), "force", "forcehead", 13),
            dot(CENTRE, 5),
            dot(CONTACT, 5),
            text((410, 148), "X", "symbol"),
            text((434, 172), "R", "symbol"),
            text((478, 192), "C", "symbol"),
            text((382, 262), "weight", "force-text", "end"),
            text((318, 128), "body"),
            path([(500, 132), (468, 190)], "thin"),
            text((506, 132), "contact point", anchor="start"),
            path([(352, 60), (391, 150)], "thin"),
            text((340, 54), "centre of gravity"),
        ]
    )


def frame() -> str:
    """Draw the axes of space."""
    origin = (100.0, 344.0)
    return "".join(
        [
            arrow(origin, (162, 344), "dash", "head"),
            arrow(origin, (100, 284), "dash", "head"),
            text((176, 349), "1", "symbol"),
            text((100, 276), "3", "symbol"),
            text((100, 368), "axes of space (inertial frame)", "small", "start"),
        ]
    )


def drawing() -> str:
    """Return the whole SVG file."""
    content = frame() + body() + stabilizers() + connector()
    return whole(content, WIDTH, HEIGHT, TITLE)


if __name__ == "__main__":
    if sys.argv[1:] == ["-"]:
        sys.stdout.write(drawing())
    else:
        PICTURE.write_text(drawing(), encoding="utf-8")
