"""Energies whose rest states are known in closed form, and true records of them."""

from collections.abc import Callable
from copy import deepcopy
from fractions import Fraction
from typing import Any

import numpy as np
from scipy.optimize import brentq

from rbstab.proof.check import check
from rbstab.proof.exact.expr import variable
from rbstab.proof.model import Energy
from rbstab.proof.record import Record, energy_record

X, Y, Z, W = variable(0), variable(1), variable(2), variable(3)

BOWL = 2 * X**2 + 2 * Z**2
"""Its rest state is θ1 = θ3 = 0."""

LEAN = float(brentq(lambda t: 4 * t + 3 * np.cos(t), -1.0, 0.0, xtol=1e-15))
"""θ1 where 2 θ1² + 3 sin θ1 is least."""

LEAST = 2 * LEAN**2 + 3 * float(np.sin(LEAN))
"""This least energy, J."""

BORDER = 2 * (np.pi / 2) ** 2
"""The height of the border above it: 2 θ2² at θ2 = π/2."""

EXACT = 1e-13


def state(point, index, **more):
    """Return the claim of a rest state at a point."""
    low, high = (np.array(point) + e for e in (-EXACT, EXACT))
    return {"enclosure": [low.tolist(), high.tolist()], "index": index, **more}


def record(energy, *states, **claims):
    """Return a record with one range, that of eq. 5 if no other is given."""
    pitch = "pi/2" if energy.stop is None else str(energy.stop)
    searched = {"end": ["pi", pitch, "pi"], "complete": True, "states": list(states), **claims}
    return {"format": 1, "energy": energy_record(energy), "ranges": [searched]}


def everywhere(proof, first, third, **claims):
    """Return a record that claims its rest states for all θ1 and θ3, up to ends of these."""
    searched = {"end": [first, "pi/2", third], "complete": True, "everywhere": True, **claims}
    proof["ranges"].append({**searched, "states": proof["ranges"][0]["states"]})
    return proof


def wells():
    """Two minima at θ2 = ±½ with U = 0, and a pass at θ2 = 0 with U = 1."""
    U = BOWL + 16 * (Y**2 - Fraction(1, 4)) ** 2
    states = state((0, -0.5, 0), 0), state((0, 0.5, 0), 0), state((0, 0, 0), 1)
    return record(Energy(U), *states, regions=[[0, 0.9], [1, 0.9]])


def lean():
    """One minimum; all rest states with any θ1 have θ1 = LEAN."""
    U = BOWL + 2 * Y**2 + 3 * X.sin()
    proof = record(Energy(U), state((LEAN, 0, 0), 0), level=LEAST + BORDER - 1e-6)
    return everywhere(proof, 0.7, 0.1)


def tilted(angle, sign):
    """One face of the border is lower than all others: its height is the level."""
    at = [0.0, 0.0, 0.0]
    at[angle] = -sign / 4
    end = np.pi / 2 if angle == 1 else np.pi
    U = BOWL + 2 * Y**2 + 40 * (BOWL + 2 * Y**2 - 2 * (X, Y, Z)[angle] ** 2)
    lowest = 2 * end**2 - end
    x, y, z = at
    minimum = state((x, y, z), 0)
    return record(Energy(U + sign * (X, Y, Z)[angle]), minimum, level=lowest - 1e-6)


def valley():
    """U is least on the faces θ2 = ±π/2 where θ1 + θ3 = 0 and |θ1| < 1, to 1e-9: the level."""
    U = 2 * Y**2 + 5 * (X + Z) ** 2 + Y.cos() * X**2 / 2 + (X / 2) ** 32
    return record(Energy(U), state((0, 0, 0), 0), level=BORDER - 1e-6)


def barrier():
    """A barrier closes θ2; every start converges."""
    U = BOWL + 2 * Y**2 + 5 * Y.cos() ** -2
    proof = record(Energy(U, closed=frozenset({1})), state((0, 0, 0), 0))
    return everywhere(proof, 0.5, 0.5, every_start=True)


def weak():
    """U falls toward the end of θ2, but for a barrier that only counts within 1e-10 rad of it."""
    rises = Fraction(1, 10**30) * Y.cos() ** -2
    return record(Energy(BOWL - 2 * Y**2 + rises, closed=frozenset({1})), state((0, 0, 0), 1))


def outer():
    """Barriers close all angles of the range of eq. 5; every start in it converges."""
    rises = 5 * Y.cos() ** -2 + 3 * (X / 2).cos() ** -2 + 4 * (Z / 2).cos() ** -2
    energy = Energy(BOWL + 2 * Y**2 + rises, closed=frozenset({0, 1, 2}))
    return record(energy, state((0, 0, 0), 0), every_start=True)


def stop():
    """U falls toward both stops at θ2 = ±0.9, which hold the body; θ2 = 0 is a pass."""
    energy = Energy(BOWL - 5 * Y**2, stop=Fraction(9, 10), closed=frozenset({1}))
    held = [state((0, s * 0.9, 0), 0, held=True) for s in (-1, 1)]
    return record(energy, *held, state((0, 0, 0), 1), regions=[[0, -0.2], [1, -0.2]])


def inside():
    """U rises toward both stops: nothing is held there."""
    energy = Energy(BOWL + 5 * Y**2, stop=Fraction(9, 10), closed=frozenset({1}))
    return record(energy, state((0, 0, 0), 0))


def coupled():
    """4 θ1 + θ2 = 0 and θ1 + 4 θ2 = 4: the rest state has θ2 = 16/15 and θ1 = -4/15."""
    U = BOWL + 2 * Y**2 + X * Y - 4 * Y
    return everywhere(record(Energy(U), state((-4 / 15, 16 / 15, 0), 0)), 0.5, 0.1)


def held():
    """A force that jumps at θ2 = 0.3 pulls the body there from both sides."""
    h = Y - Fraction(3, 10)
    U = BOWL + 2 * Y**2 - 6 * Y + 10 * h * h.step(1)
    return record(Energy(U), state((0, 0.3, 0), 0, held=True))


def ridge():
    """A force that jumps at θ2 = 0.3 pushes away, to minima at θ2 = -1.5 and θ2 = 1."""
    h = Y - Fraction(3, 10)
    U = BOWL + 2 * Y**2 + 6 * Y - 10 * h * h.step(1)
    minima = state((0, -1.5, 0), 0), state((0, 1, 0), 0)
    return record(Energy(U), *minima, state((0, 0.3, 0), 1, held=True, ridge=True))


def tent():
    """A ridge at θ2 = 0.3, where U = 0, between two minima with U = -2."""
    h = Y - Fraction(3, 10)
    U = BOWL + 8 * h**2 + 8 * h - 16 * h * h.step(1)
    minima = state((0, -0.2, 0), 0), state((0, 0.8, 0), 0)
    ridge = state((0, 0.3, 0), 1, held=True, ridge=True)
    return record(Energy(U), *minima, ridge, regions=[[0, -0.1], [1, -0.1]])


def through():
    """Two wells: from the lower one to the pass, the force jumps at θ2 = -¼ but does not turn."""
    h = Y + Fraction(1, 4)
    U = BOWL + 16 * (Y**2 - Fraction(1, 4)) ** 2 + h * h.step(1) / 10

    def slope(t: float) -> float:
        return 64 * t * (t**2 - 0.25) + 0.1

    top, other = (float(brentq(slope, a, b, xtol=1e-15)) for a, b in ((-0.2, 0.2), (0.3, 0.7)))
    states = state((0, -0.5, 0), 0), state((0, top, 0), 1), state((0, other, 0), 0)
    return record(Energy(U), *states, regions=[[0, 0.8]])


def plane():
    """The force jumps on 3 θ1 + 5 θ2 = 2 and holds the body there.

    Without it, the body would rest at θ1 = θ2 = ½. On the plane, Θ = ½ - λ (3, 5) with 34 λ = 2.
    """
    h = 3 * X + 5 * Y - 2
    half = Fraction(1, 2)
    U = 2 * ((X - half) ** 2 + (Y - half) ** 2 + Z**2) + h * h.step(1)
    return record(Energy(U), state((0.5 - 6 / 34, 0.5 - 10 / 34, 0), 0, held=True))


def sphere():
    """U falls from a top at zero to |Θ| = ½, beyond which it rises: each axis meets it twice."""
    h = X**2 + Y**2 + Z**2 - Fraction(1, 4)
    U = -(X**2 + 2 * Y**2 + 3 * Z**2) / 2 + 2 * h * h.step(1)
    places = [(tuple(s * 0.5 * np.eye(3)[k]), 2 - k) for k in range(3) for s in (-1, 1)]
    held = [state((x, y, z), index, held=True) for (x, y, z), index in places]
    return record(Energy(U), *held, state((0, 0, 0), 3))


ANGLE = float(np.arctan2(4, 3))
"""Where the line of `SQUARE` is shortest."""

SQUARE = 10 - (Fraction(18, 5) * X.cos() + Fraction(24, 5) * X.sin()) * Y.cos()
"""The square of the length of a line: 10 - 6 cos(θ1 - `ANGLE`) cos θ2."""


def _length(angle):
    return float(np.sqrt(10 - 6 * np.cos(angle - ANGLE)))


def ligament():
    """A load pushes θ1 down to -2; a ligament pulls it back, with a toe from ℓ = 3 to 3.5.

    Its energy is (ℓ - 3)³, which goes on beyond the toe as a quadratic. Each step begins where a
    square of the length is passed, and the root is taken where the ligament is taut.
    """
    taut = SQUARE - 9
    length = (9 + taut.function("positive")).sqrt()
    beyond = (taut - Fraction(13, 4)).step(3) * (length - Fraction(7, 2)) ** 3
    U = BOWL + 2 * Y**2 + 8 * X + taut.step(3) * ((length - 3) ** 3 - beyond)

    def slope(t: float) -> float:
        pull = 9 * (max(_length(t) - 3, 0) ** 2 - max(_length(t) - 3.5, 0) ** 2)
        return 4 * t + 8 + pull * float(np.sin(t - ANGLE)) / _length(t)

    return record(Energy(U), state((float(brentq(slope, -2, -0.5, xtol=1e-15)), 0, 0), 0))


def flat():
    """At θ2 = 0 the second derivative is zero too: this rest state is left undecided."""
    box = [[-0.01, -0.01, -0.01], [0.01, 0.01, 0.01]]
    proof = record(Energy(BOWL + Y**4), undecided=[box])
    return changed(proof, "ranges", 0, "complete", to=False)


def unfinished():
    """As `wells`, but the box of the pass is undecided; it ends the regions."""
    proof = wells()
    proof["ranges"][0].update(complete=False, undecided=[[[-0.01] * 3, [0.01] * 3]])
    del proof["ranges"][0]["states"][2]
    return proof


def own_state():
    """An own state z with U convex in it; at rest both slopes of U are zero."""
    U = BOWL + 2 * Y**2 + 10 * W**2 + 4 * W**4 - W + X.sin() * W
    z = float(brentq(lambda t: 20 * t + 16 * t**3 - 1, -1, 1, xtol=1e-15))

    def slope(t: float) -> float:
        best = brentq(lambda w: 20 * w + 16 * w**3 - 1 + np.sin(t), -1, 1, xtol=1e-15)
        return 4 * t + np.cos(t) * best

    lean = float(brentq(slope, -z, z, xtol=1e-15))
    return everywhere(record(Energy(U, (3,)), state((lean, 0, 0), 0)), 0.5, 0.1)


def own_state_at_stop():
    """A body with an own state z presses against the stop at θ2 = 0.9: U falls with θ2 inside.

    Over z it is least at z with 20 z + 16 z³ = θ2, and ∂V/∂θ2 = 4 θ2 - 8 - z < 0.
    """
    U = BOWL + 2 * Y**2 - 8 * Y + 10 * W**2 + 4 * W**4 - W * Y
    energy = Energy(U, (3,), stop=Fraction(9, 10), closed=frozenset({1}))
    return record(energy, state((0, 0.9, 0), 0, held=True))


SMOOTH = wells, lean, valley, barrier, outer, coupled, own_state
SWITCHING = stop, inside, held, tent, through, plane, sphere, ridge, ligament, own_state_at_stop
CASES = *SMOOTH, *SWITCHING, flat, unfinished

TRUE: dict[str, Callable[[], Record]] = {case.__name__: case for case in CASES}


def refused(proof):
    """Return the claims of a record that are not verified."""
    return [finding.claim for finding in check(deepcopy(proof)) if not finding.verified]


def changed(proof, *path, to):
    """Return a record with another value at a place."""
    other = deepcopy(proof)
    at: Any = other
    for key in path[:-1]:
        at = at[key]
    at[path[-1]] = to
    return other
