"""A fingerprint of the equations of a system: their values at one point of a finite field.

The equations are evaluated with numbers modulo a prime p, which are exact and fast. Different
equations have different values, but for an accident with a probability of about 1e-36; a
rearranged formula has the same ones. A sine s and a cosine c are chosen on s² + c² = 1. Of other
functions nothing is known but their names: their values are drawn for each argument.
"""

import hashlib
import operator
from collections.abc import Callable
from typing import Any

import numpy as np

from rbstab.analysis.configuration import configurations, without_inputs
from rbstab.analysis.exact import decimals
from rbstab.mechanics.numbers import Array, entrywise
from rbstab.systems.system import System

P = 2**127 - 1
"""The prime p."""

FUNCTIONS = frozenset({"exp", "log", "tan", "atan", "sinh", "cosh", "tanh"})
"""Functions whose values are drawn."""


class Residue:
    """A number modulo p.

    Args:
        value: The number.
        half: tan x/2, by default a number that belongs to x.
    """

    __slots__ = ("half", "value")

    def __init__(self, value: int, half: int | None = None) -> None:
        self.value, self.half = value % P, half

    def sin(self) -> "Residue":
        """Return 2h/(1 + h²)."""
        h = self._tangent()
        return Residue(2 * h * pow(1 + h * h, -1, P))

    def cos(self) -> "Residue":
        """Return (1 - h²)/(1 + h²)."""
        h = self._tangent()
        return Residue((1 - h * h) * pow(1 + h * h, -1, P))

    def sqrt(self) -> "Residue":
        """Return x^((p + 1)/4), whose square is x or -x, because p = 3 mod 4."""
        return Residue(pow(self.value, (P + 1) // 4, P))

    def __getattr__(self, name: str) -> Callable[[], "Residue"]:
        """Return one of `FUNCTIONS`."""
        if name not in FUNCTIONS:
            raise AttributeError(name)
        return lambda: _some(f"{name} of {self.value}")

    def _tangent(self) -> int:
        return _some(f"half of {self.value}").value if self.half is None else self.half

    def _combine(self, other: Any, operation: Callable[[int, int], int]) -> "Residue":
        if isinstance(other, np.ndarray):
            return NotImplemented  # numpy takes over, entry by entry
        return Residue(operation(self.value, residue(other).value))

    def __add__(self, other: Any) -> "Residue":
        return self._combine(other, operator.add)

    def __sub__(self, other: Any) -> "Residue":
        return self + -other

    def __rsub__(self, other: Any) -> "Residue":
        return -self + other

    def __mul__(self, other: Any) -> "Residue":
        return self._combine(other, operator.mul)

    def __truediv__(self, other: Any) -> "Residue":
        return self._combine(other, lambda a, b: a * pow(b, -1, P))

    def __rtruediv__(self, other: Any) -> "Residue":
        return other * Residue(pow(self.value, -1, P))

    def __neg__(self) -> "Residue":
        return Residue(-self.value)

    __radd__ = __add__
    __rmul__ = __mul__


def residue(number: Any) -> Residue:
    """Return a double, an integer or a fraction modulo p, exactly."""
    if isinstance(number, Residue):
        return number
    numerator, denominator = number.as_integer_ratio()
    return Residue(numerator if denominator == 1 else numerator * pow(denominator, -1, P))


def residues(values: Array) -> Array:
    """Return the numbers that the doubles of a config mean, modulo p."""
    return entrywise(residue, decimals(values))


def fingerprint(exact_system: Callable[[Callable[[Array], Array]], System]) -> str:
    """Return a digest of the rates, energies, dissipations and forces of a system at one state.

    Args:
        exact_system: Builds the system in a kind of number from the doubles of its config. The
            choice among coordinates that mean the same has no effect. Inputs have none either:
            nothing is proved where they act.
    """
    system = without_inputs(configurations(exact_system(residues)).system)
    y = np.array([_some(f"state {index}") for index in range(system.size)], dtype=object)
    y[:3] = [Residue(y[i].value, _some(f"angle {i}").value) for i in range(3)]
    seen = system.observe(y)
    parts = (system.rates(y), seen.energy, seen.dissipation, seen.contact_force)
    values = [[residue(entry).value for entry in part.tolist()] for part in parts]
    return hashlib.sha256(repr(values).encode()).hexdigest()[:32]


def _some(name: str) -> Residue:
    """Return a number that belongs to a name."""
    return Residue(int.from_bytes(hashlib.sha256(name.encode()).digest()))
