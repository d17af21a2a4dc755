"""Passive elements, each with its wrench, stored energy, dissipation and own states.

The formulas of an element are only in its file. The Lyapunov function is the kinetic energy of the
body plus the stored energy of the elements. Its derivative is minus the sum of their dissipations.
A new connector needs one new file and one line in `registry.py`.

The names in `__all__` are what the file of an element of a user needs (docs/own_elements.md).
"""

from rbstab.elements.declarations import ANCHOR, POINT, Gain, OwnState
from rbstab.elements.element import (
    Element,
    couple_on_body,
    force_at_centre,
    force_at_contact,
)
from rbstab.elements.spring import line
from rbstab.mechanics.algebra import cross
from rbstab.mechanics.motion import Motion, Wrench
from rbstab.mechanics.numbers import atan, cos, cosh, exp, log, power, sin, sinh, sqrt, tan, tanh
from rbstab.mechanics.point import force_at, position, velocity

__all__ = [
    "ANCHOR",
    "POINT",
    "Element",
    "Gain",
    "Motion",
    "OwnState",
    "Wrench",
    "atan",
    "cos",
    "cosh",
    "couple_on_body",
    "cross",
    "exp",
    "force_at",
    "force_at_centre",
    "force_at_contact",
    "line",
    "log",
    "position",
    "power",
    "sin",
    "sinh",
    "sqrt",
    "tan",
    "tanh",
    "velocity",
]
