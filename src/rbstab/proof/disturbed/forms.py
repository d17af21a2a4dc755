"""A Lyapunov function of a disturbed body, and its rate, as quadratic forms in all but Θ.

With the velocities ν, (Ω, V) or Ω alone if the contact point is held,

    V = T + Π - Π* + ε p'∂T/∂ν,    p = (B⁻¹Θ, X - X*):

the energy above that of the rest state, and a cross term. V' is its derivative along the equations
of the system, on which the loads w act as inputs. Both are exact expressions. At each Θ they are
z'M(Θ)z with z = (1, x, u, w), where x is E and the own states less theirs at rest, and u is (Ω, F),
or Ω. This is found from the expressions, and not assumed. E and F stand for X and V because a stiff
connector then is a large number in M, and not a difference of large functions of Θ.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from rbstab.analysis.configuration import configurations
from rbstab.elements.element import Element
from rbstab.elements.inputs.loads import BodyCoupleInput, BodyForceInput
from rbstab.elements.inputs.signals import Constant
from rbstab.mechanics import contact
from rbstab.mechanics.attitude import rate_matrix_inverse, rotation
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import OMEGA, THETA, V_OF_Z, X_OF_Z
from rbstab.proof.exact.atoms import LET, VAR, Atom, Monomial, monomial
from rbstab.proof.exact.expr import Expr, atom, expr, summed, variables
from rbstab.proof.exact.matrices import inverse_of_definite
from rbstab.proof.exact.rewriting import derivative, quadratic_in, spread, substituted
from rbstab.systems.system import System

Rows = list[list[Expr]]
"""A symmetric matrix of expressions of Θ."""

AT_ZERO = {atom(VAR, k): expr(0) for k in range(3)}

NOT_QUADRATIC = (
    "at a fixed attitude the energy, or its rate, is not quadratic in positions and velocities"
)


class NoFormsError(Exception):
    """A body has no such function V; the text says why."""


class Load(NamedTuple):
    """A load of any course and direction on the body.

    Attributes:
        kind: `couple`, or `force`.
        point: Where a force acts, shape (3,), m, body coordinates, from the centre of gravity.
    """

    kind: str
    point: tuple[float, ...] = (0.0, 0.0, 0.0)

    def acting(self, w: Array) -> Element:
        """Return the input of a load w: a ball |w| <= w̄ is the same in all frames."""
        if self.kind == "couple":
            return BodyCoupleInput(name=self.kind, direction=w, amplitude=1.0, signal=Constant())
        point = np.array(self.point, dtype=object)
        return BodyForceInput(
            name=self.kind, direction=w, amplitude=1.0, signal=Constant(), point=point
        )


def driven(system: System, loads: Sequence[Load], w: Array) -> System:
    """Return a system with the loads w on it.

    Args:
        system: The system.
        loads: The n loads.
        w: Their values, shape (3 n,): N m of a couple, N of a force, in body coordinates.
    """
    inputs = [load.acting(w[3 * k : 3 * k + 3]) for k, load in enumerate(loads)]
    return replace(system, elements=(*system.elements, *inputs))


@dataclass(frozen=True, eq=False)
class Forms:
    """V = V0 + εV1 and V' = V0' + εV1' as matrices over z = (1, x, u, w).

    Args:
        values: Those of V0 and V1.
        rates: Those of V0' and V1'.
        still: The number of entries of (1, x, u); three for each load follow.
        rest: The state at rest: Z, or that of the held body, and own states; in doubles.
    """

    values: tuple[Rows, Rows]
    rates: tuple[Rows, Rows]
    still: int
    rest: Array

    def value(self, cross: Fraction) -> Rows:
        """Return the matrix of V over (1, x, u), with ε = cross."""
        return [row[: self.still] for row in _sum(*self.values, cross)[: self.still]]

    def decrease(self, cross: Fraction, rate: Fraction) -> Rows:
        """Return the matrix of -(V' + αV) over z, with ε = cross and α = rate."""
        whole = _sum(_sum(*self.rates, cross), _sum(*self.values, cross), rate)
        return [[-e for e in row] for row in whole]


def _sum(M: Rows, N: Rows, factor: Fraction) -> Rows:
    """Return M + factor N."""
    pairs = zip(M, N, strict=True)
    return [[a + b.scaled(factor) for a, b in zip(*rows, strict=True)] for rows in pairs]


def forms_of(system: System, loads: Sequence[Load]) -> Forms:
    """Return V and V' of a system under loads.

    Args:
        system: The system, in exact expressions.
        loads: The loads.

    Raises:
        NoFormsError: V or V' is not quadratic, or the body does not rest at Θ = 0.
    """
    reason = next(filter(None, map(_why_not, system.elements)), None)
    if reason is not None:
        raise NoFormsError(reason)
    system = configurations(system).system
    held, n = system.coordinates.holds_contact, system.size
    every = range(n + 3 * len(loads))
    positions = [] if held else list(every[X_OF_Z])
    velocities = list(every[OMEGA]) + ([] if held else list(every[V_OF_Z]))
    x = positions + list(every[system.coordinates.size : n])
    y, rest = variables(range(n)), np.full(n, expr(0))
    stored = expr(system.potential_energy(y))
    rest[x] = _rest(_placed(stored, _places(system, y)), x)
    places = _places(system, y + rest)
    stored = stored - _least(_placed(stored, places), x)
    motion = system.motion(y)
    kinetic = expr(system.body.kinetic_energy(motion.Omega, motion.V))
    rest[positions] = rest[positions] + system.anchor[: len(positions)]  # X* = E* + X_a at Θ = 0
    p = [*(rate_matrix_inverse(y[THETA]) @ y[THETA]), *(y - rest)[positions]]
    momentum = (derivative(kinetic, {k: expr(1)}) for k in velocities)
    cross = summed(expr(a) * b for a, b in zip(p, momentum, strict=True))
    rates = driven(system, loads, variables(every[n:])).rates(y).tolist()
    by_time = dict(enumerate(map(expr, rates)))
    z = [*x, *velocities, *every[n:]]

    def matrix(e: Expr) -> Rows:
        return _matrix(_placed(e, places), z)

    return Forms(
        (matrix(kinetic + stored), matrix(cross)),
        (matrix(derivative(kinetic + stored, by_time)), matrix(derivative(cross, by_time))),
        1 + len(x) + len(velocities),
        np.array([float(expr(e)._number()) for e in rest]),
    )


def _places(system: System, y: Array) -> dict[Atom, Expr]:
    """Return what the states Z are, where y has E and F in place of X and V (eq. 4)."""
    places = y.copy()
    if not system.coordinates.holds_contact:
        body, A = system.body, rotation(y[THETA])
        places[X_OF_Z] = contact.centre_position(body, A, y[X_OF_Z], system.anchor)
        places[V_OF_Z] = contact.centre_velocity(body, A, y[OMEGA], y[V_OF_Z])
    return {atom(VAR, k): expr(e) for k, e in enumerate(places.tolist())}


def _placed(e: Expr, places: dict[Atom, Expr]) -> Expr:
    """Return an expression of other variables, multiplied out, so that terms cancel."""
    e = substituted(e, places)
    while any(a.kind == LET and p > 0 for m in e.terms for a, p in m):
        e = spread(e)
    return e


def _why_not(element: Element) -> str | None:
    """Return why an element is in no such proof."""
    if element.from_user:
        return f"{element.name} is code of a user"
    if element.supplies:
        return f"the element {element.name} supplies power"
    switches = element.mode_count or element.slides or element.holds or element.timed
    if switches or not element.smooth:
        return f"the force of {element.name} is not one smooth formula"
    return None


def _rest(stored: Expr, x: Sequence[int]) -> Array:
    """Return x* where the stored energy is least at Θ = 0."""
    if not x:
        return np.array([])
    parts = quadratic_in(substituted(stored, AT_ZERO), x)
    if parts.rest.constant is None or any(b.constant is None for b in parts.b):
        raise NoFormsError(NOT_QUADRATIC)
    inverse = inverse_of_definite(parts.H)
    if inverse is None:
        raise NoFormsError("nothing holds the position, or an own state")
    return -np.array(inverse, dtype=object) @ np.array(parts.b)


def _least(stored: Expr, x: Sequence[int]) -> Expr:
    """Return the stored energy at Θ = 0, x = 0, where the body must rest."""
    at_rest = AT_ZERO | {atom(VAR, k): expr(0) for k in x}
    slopes = [substituted(derivative(stored, {k: expr(1)}), at_rest).constant for k in range(3)]
    if any(slopes):
        raise NoFormsError("the body does not rest at Θ = 0, from where the tilt is counted")
    if None in slopes:
        raise NoFormsError("it is not known whether the body rests at Θ = 0")
    return substituted(stored, at_rest)


def _matrix(e: Expr, numbers: Sequence[int]) -> Rows:
    """Return the M(Θ) with e = z'Mz, z = (1, the variables with some numbers)."""
    place = {k: i for i, k in enumerate(numbers, start=1)}
    size = len(place) + 1
    entries: list[list[dict[Monomial, Fraction]]] = [[{} for _ in range(size)] for _ in range(size)]
    for m, c in e.terms.items():
        indices = [place[a.argument] for a, p in m if _is_placed(a, place) for _ in range(p)]
        rest = monomial((a, p) for a, p in m if not _is_placed(a, place))
        inside = any(not a.variables.isdisjoint(place) for a, _ in rest)
        if inside or len(indices) > 2 or any(p < 0 for a, p in m if _is_placed(a, place)):
            raise NoFormsError(NOT_QUADRATIC)
        i, j = [*indices, 0, 0][:2]
        for row, column in ((i, j), (j, i)):
            entry = entries[row][column]
            entry[rest] = entry.get(rest, Fraction(0)) + c / 2
    return [[Expr(entry) for entry in row] for row in entries]


def _is_placed(a: Atom, place: dict[int, int]) -> bool:
    return a.kind == VAR and a.argument in place
