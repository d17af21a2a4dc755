"""Files with elements of users, and configs that name them."""

import textwrap
from pathlib import Path

from rbstab.config.load import load_config
from rbstab.elements.user_code.template import TEMPLATE

HEAD = """\
# Tests name the lines below these.

import numpy as np

from rbstab.elements import *

"""

CUBIC = {
    "kind": "python",
    "file": "cubic_spring.py",
    "class": "CubicSpring",
    "parameters": {"k": [30.0, 20.0, 10.0]},
}


def element_text(body, gains='Gain("k", "N/m", "stiffness", shape="number")'):
    """Return the text of a file with one class `Mine`, from the text of its statements."""
    statements = textwrap.indent(textwrap.dedent(body), "    ")
    return f"{HEAD}\nclass Mine(Element):\n    gains = ({gains},)\n\n{statements}\n"


SPRING = element_text("""
    def wrench(self, motion, states):
        return force_at_centre(-self.k * motion.X)

    def stored(self, motion, states):
        return 0.5 * self.k * (motion.X @ motion.X)
    """)
"""A linear spring of the centre of gravity."""


TIE = element_text(
    """
    def wrench(self, motion, states):
        e = position(motion, self.point) - self.anchor
        f = velocity(motion, self.point)
        return force_at(motion, self.point, -self.K_c @ e - self.L_c @ f)

    def stored(self, motion, states):
        e = position(motion, self.point) - self.anchor
        return 0.5 * (e @ self.K_c @ e)

    def dissipated(self, motion, states):
        f = velocity(motion, self.point)
        return f @ self.L_c @ f
    """,
    'POINT, ANCHOR, Gain("K_c", "N/m", "K"), Gain("L_c", "N s/m", "L", dissipates=True)',
)
"""What `kind: visco-elastic` is."""

MAXWELL = element_text(
    """
    states = (OwnState("extension", "s", "m", "extension of the spring", size=1),)

    def rates(self, motion, states):
        along = line(motion, self.point, self.anchor)
        return np.array([along.rate]) - self.k / self.c * states

    def wrench(self, motion, states):
        along = line(motion, self.point, self.anchor)
        return force_at(motion, self.point, -self.k * states[0] * along.direction)

    def stored(self, motion, states):
        return 0.5 * self.k * states[0] * states[0]

    def dissipated(self, motion, states):
        return (self.k * states[0]) * (self.k * states[0]) / self.c
    """,
    'POINT, ANCHOR, Gain("k", "N/m", "stiffness", shape="number"), '
    'Gain("c", "N s/m", "damping", shape="number")',
)
"""A spring and a damper in a row. Its stored energy depends on its own state alone."""

ROPE = element_text(
    """
    mode_count = 1

    def guards(self, motion, states):
        return np.array([line(motion, self.point, self.anchor).length - self.k])

    def wrench(self, motion, states):
        along = line(motion, self.point, self.anchor)
        tension = self.mode[0] * (along.length - self.k)
        return force_at(motion, self.point, -tension * along.direction)

    def stored(self, motion, states):
        extension = line(motion, self.point, self.anchor).length - self.k
        return 0.5 * self.mode[0] * extension * extension
    """,
    'POINT, ANCHOR, Gain("k", "m", "length", shape="number")',
)
"""A line that only pulls."""

CREEPING_TIE = Path(__file__).parents[2] / "configs" / "examples" / "creeping_tie.py"
"""The file of the example: an element of users that is the embedded tie of the program."""


def python_section(**parameters):
    """Return the section of an element whose file `mine.py` has the class `Mine`."""
    return {"kind": "python", "file": "mine.py", "class": "Mine", "parameters": parameters}


def loaded_with(elements, variant="permanent", **changes):
    """Return the config of a body under a load, with elements whose code may run."""
    gains = {"K_t": [40, 40, 30], "L_t": [2, 2, 1], "K_r": [4, 4, 3], "L_r": [0.6, 0.6, 0.4]}
    if variant != "permanent":
        gains |= {"K_c": [400, 300, 500], "L_c": [10, 10, 10]}
    data = {
        "schema_version": 2,
        "body": {"mass": 2, "inertia": [1, 1.5, 2], "contact_point": [0.1, -0.1, -0.3]},
        "gravity": [1.0, 3.0, -9.81],
        "controller": {"variant": variant} | gains,
        "elements": elements,
        "initial": {"angular_velocity": [0.2, -0.3, 0.2], "orientation": [-0.3, -0.2, -0.3]},
        "integration": {"duration": 20.0, "samples": 51},
    }
    return load_config(data | changes, allow_python=True)


def write_template(folder):
    """Write the template of an element into a folder."""
    path = folder / "cubic_spring.py"
    path.write_text(TEMPLATE, encoding="utf-8")
    return path


def traitor(marker):
    """Return the text of a file that leaves a marker when any of it runs."""
    leave = f"open({str(marker)!r}, 'a').close()"
    return (
        f"{HEAD}\n{leave}\n\nclass Mine(Element):\n    {leave}\n"
        '    gains = (Gain("k", "N/m", "stiffness", shape="number"),)\n\n'
        f"    def wrench(self, motion, states):\n        {leave}\n"
        "        return force_at_centre(-self.k * motion.X)\n\n"
        f"    def stored(self, motion, states):\n        {leave}\n"
        "        return 0.5 * self.k * (motion.X @ motion.X)\n"
    )
