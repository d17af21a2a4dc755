"""Files with elements of users, and configs that name them."""

import textwrap
from pathlib import Path
from typing import Any

from rbstab.elements.user_code.template import TEMPLATE

HEAD = """\
import numpy as np

from rbstab.elements import ANCHOR, POINT, Element, Gain, couple_on_body, cross, exp
from rbstab.elements import force_at, force_at_centre, force_at_contact, line, position
from rbstab.elements import power, tanh, velocity

"""

CUBIC = {
    "kind": "python",
    "file": "cubic_spring.py",
    "class": "CubicSpring",
    "parameters": {"k": [30.0, 20.0, 10.0]},
}


def element_text(body: str, gains: str = 'Gain("k", "N/m", "stiffness", shape="number")') -> str:
    """Return the text of a file with one class `Mine`, from the text of its statements."""
    statements = textwrap.indent(textwrap.dedent(body), "    ")
    return f"{HEAD}\nclass Mine(Element):\n    gains = ({gains},)\n\n{statements}\n"


SPRING = element_text("""
    def wrench(self, motion, own):
        return force_at_centre(-self.k * motion.X)

    def stored(self, motion, own):
        return 0.5 * self.k * (motion.X @ motion.X)
    """)
"""A linear spring of the centre of gravity."""


def mine(**parameters: Any) -> dict[str, Any]:
    """Return the section of an element whose file `mine.py` has the class `Mine`."""
    return {"kind": "python", "file": "mine.py", "class": "Mine", "parameters": parameters}


def write_template(folder: Path) -> Path:
    """Write the template of an element into a folder."""
    path = folder / "cubic_spring.py"
    path.write_text(TEMPLATE, encoding="utf-8")
    return path


def traitor(marker: Path) -> str:
    """Return the text of a file that leaves a marker when any of it runs."""
    leave = f"open({str(marker)!r}, 'a').close()"
    return (
        f"{HEAD}\n{leave}\n\nclass Mine(Element):\n    {leave}\n"
        '    gains = (Gain("k", "N/m", "stiffness", shape="number"),)\n\n'
        f"    def wrench(self, motion, own):\n        {leave}\n"
        "        return force_at_centre(-self.k * motion.X)\n\n"
        f"    def stored(self, motion, own):\n        {leave}\n"
        "        return 0.5 * self.k * (motion.X @ motion.X)\n"
    )
