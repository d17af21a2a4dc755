"""The energy to be proved about: traced once from the equations, with X and own states eliminated.

The system of a config is built with exact expressions as its numbers, so the weight, the anchor and
all else that follows from the config are exact. Modes of elements that switch become steps of their
event functions: one formula holds on all sides of a switch.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from rbstab.analysis.configuration import Configurations, configurations
from rbstab.elements.element import Element
from rbstab.elements.ligament import Ligament
from rbstab.mechanics.motion import Motion
from rbstab.mechanics.numbers import Array
from rbstab.proof.enclosures.taylor import value_at
from rbstab.proof.exact.atoms import COS, LET, SIN, STEP, VAR, Atom
from rbstab.proof.exact.expr import Expr, atom, expr, numbers, only, summed, variable, variables
from rbstab.proof.exact.lengths import with_lengths_apart, with_squares
from rbstab.proof.exact.matrices import inverse_of_definite
from rbstab.proof.exact.rewriting import (
    Quadratic,
    quadratic_in,
    spread,
    substituted,
    with_outlined_steps,
    with_unit_steps,
)
from rbstab.proof.passive.passive import first_jump
from rbstab.proof.passive.statements import state_numbers_of
from rbstab.proof.reasons import NoEnergyReason, NoReducedEnergy
from rbstab.systems.parameters import map_parameters
from rbstab.systems.system import System

THETA = (0, 1, 2)
"""The numbers of the variables Θ; those of X and of own states follow, as in a configuration q."""

ExactSystem = Callable[[Callable[[Array], Array]], System]
"""A function that builds a system in a kind of number, without elements of users."""

RANGE_END = np.nextafter(np.pi, np.inf) * np.array([1.0, 0.5, 1.0])
"""rad: the largest |θ1|, |θ2| and |θ3| in the closed range of eq. 5, rounded outwards."""

COSINE = atom(COS, variable(1))
"""cos θ2, which is not negative in the range."""


HALVES = {k: atom(COS, variable(k).scaled(Fraction(1, 2))) for k in (0, 2)}
"""cos ½θ1 and cos ½θ3, which are not negative for angles from -π to π."""


class NoMinimumError(Exception):
    """The energy has no single minimum over X and own states: they are not held."""


@dataclass(frozen=True, eq=False)
class Energy:
    """The potential energy U(Θ, z), J, least over all other entries of a configuration.

    Args:
        U: The energy.
        free: The numbers of the variables z that are left: positions and own states.
        minimiser: Each other entry of a configuration where U is least, as an expression of Θ.
        shift: For each z the place from where it is counted, as an expression of Θ.
        stop: The largest |θ2| that a stop allows, rad; None without one.
        closed: The angles, 0 to 2, of which no motion reaches the end of the range.
        plain: U before terms of one switch were taken together (`with_outlined_steps`).
    """

    U: Expr
    free: tuple[int, ...] = ()
    minimiser: Mapping[int, Expr] = field(default_factory=dict)
    shift: Mapping[int, Expr] = field(default_factory=dict)
    stop: Fraction | None = None
    closed: frozenset[int] = frozenset()
    plain: Expr | None = None

    @property
    def least(self) -> dict[Atom, float]:
        """Known lower bounds of atoms where |θ2| <= π/2, and where barriers keep a motion."""
        return {COSINE: 0.0} | {HALVES[k]: 0.0 for k in self.closed if k in HALVES}

    def completed(self, q: Array) -> Array:
        """Return a configuration of known Θ and z with all else where U is least, to round-off."""
        q = q.copy()
        for k, shift in self.shift.items():
            q[k] += value_at(shift, q)
        for k, place in self.minimiser.items():
            q[k] = value_at(place, q)
        return q


class Stored(NamedTuple):
    """The stored energy Π(q) of all configurations q, before X and own states are eliminated.

    Attributes:
        total: Π, J, an expression of the variables q.
        size: The number of entries of q.
        stop: The largest |θ2| that a stop allows, rad, an expression; None without one.
    """

    total: Expr
    size: int
    stop: Expr | None


def energy_of(system: System, exact_system: ExactSystem) -> Energy:
    """Return the potential energy of a system, least over X and own states.

    Args:
        system: The system, in doubles.
        exact_system: Builds the same in other numbers, from the numbers of its config, without the
            elements of users. These get the numbers that their doubles mean.

    Raises:
        NoMinimumError: Nothing holds the position, or an own state.
        NoReducedEnergy: The angle of a stop is no number.
        TypeError: Code of a user branches on a value, or takes no such numbers.
    """
    total, size, end = stored_energy(system, exact_system)
    reduced = eliminated(total, range(3, size))
    stop = None if end is None else end.constant
    if end is not None and stop is None:
        raise NoReducedEnergy(NoEnergyReason.STOP_VARIES)
    closed = _poles(reduced.U) | ({1} if stop is not None else set())
    return replace(reduced, stop=stop, closed=frozenset(closed))


def stored_energy(system: System, exact_system: ExactSystem) -> Stored:
    """Return the stored energy of a system as one expression; arguments as for `energy_of`."""
    at_rest = configurations(system)
    exact = configurations(_exact(system, exact_system))
    q = variables(range(at_rest.size))
    motion, total, stop = exact.motion(q), expr(0), None
    elements: list[Any] = list(exact.system.elements)
    for given, element in zip(at_rest.system.elements, elements, strict=True):
        element_states = q[state_numbers_of(at_rest, given)]
        if element.holds:  # a stop: it stores nothing, and ends the range
            at_stop: Any = element
            stop = expr(at_stop.angle)
            continue
        acting = element
        if element.mode_count:
            acting = with_steps(element, motion, element_states, _first_jump(at_rest, given))
        total = total + acting.stored(motion, element_states)
    total = with_unit_steps(_without_opposite_steps(total))
    return Stored(_by_half_angles(total), at_rest.size, stop)


def with_steps(element: Any, motion: Motion, element_states: Array, smooth: int) -> Any:
    """Return an element with steps of its event functions as its modes.

    Args:
        element: The element.
        motion: The motion at which its event functions are taken.
        element_states: Its own states there.
        smooth: As for `Expr.step`.
    """
    steps = [expr(g).step(smooth) for g in element.guards(motion, element_states)]
    return replace(element, mode=np.array(steps, dtype=object))


def _first_jump(at_rest: Configurations, element: Element) -> int:
    """Return the order of the first derivative of the energy of an element that may jump."""
    if element.kinked or not element.from_user:
        return 1 if element.kinked else 3 if isinstance(element, Ligament) else 2
    return first_jump(at_rest, element)


def _exact(system: System, exact_system: ExactSystem) -> System:
    """Return a system with exact numbers, with the elements of users in their places."""
    others = iter(exact_system(numbers).elements)
    elements = []
    for element in system.elements:
        if element.from_user:
            alone = replace(system, elements=(element,))
            (exact_element,) = map_parameters(alone, lambda _, values: numbers(values)).elements
            elements.append(exact_element)
        else:
            elements.append(next(others))
    built = exact_system(numbers)
    return replace(built, elements=tuple(elements), coordinates=system.coordinates)


def eliminated(total: Expr, others: range) -> Energy:
    """Minimise over all variables in which the energy is quadratic with constant stiffness."""
    total = with_lengths_apart(total, others)
    inside = {v for a in total.atoms if a.kind != VAR for v in a.variables if v >= others.start}
    parts, chosen = None, [k for k in others if k not in inside]
    # Variables with other powers, or with a stiffness that depends on Θ, stay.
    while parts is None or not parts.rest.variables.isdisjoint(chosen):
        chosen = [k for k in chosen if parts is None or k not in parts.rest.variables]
        parts = quadratic_in(total, chosen)
    inverse = inverse_of_definite(parts.H)
    if inverse is None:
        raise NoMinimumError
    star, least = _least(parts, inverse)
    U, minimiser = parts.rest + least, dict(zip(chosen, star, strict=True))
    free = tuple(k for k in others if k not in chosen)
    U, shift = _shifted(U, free)
    U = with_squares(U, free)
    return Energy(with_outlined_steps(U), free, minimiser, shift, plain=U)


def _shifted(U: Expr, free: tuple[int, ...]) -> tuple[Expr, dict[int, Expr]]:
    """Count the variables that are left from where the quadratic part of U is least."""
    if not free:
        return U, {}
    parts = quadratic_in(U, free, constant=(VAR, SIN, COS))
    inverse = inverse_of_definite(parts.H)
    if inverse is None:
        return U, {}
    # With x = x*(Θ) + z that part is U_Q(Θ) + ½ z'Hz, and only the rest N(Θ, x* + z) keeps its
    # form.
    star, least = _least(parts, inverse)
    z = [variable(k) for k in free]
    moved = {atom(VAR, k): x + offset for k, x, offset in zip(free, star, z, strict=True)}
    n = range(len(free))
    around = summed((z[i] * z[j]).scaled(parts.H[i][j] / 2) for i in n for j in n)
    U = substituted(parts.rest, moved) + least + around
    return U, dict(zip(free, star, strict=True))


def _least(parts: Quadratic, inverse: list[list[Fraction]]) -> tuple[list[Expr], Expr]:
    """Return where ½ x'Hx + b'x is least, x* = -H⁻¹b, and its value there, ½ b'x*."""
    n = range(len(parts.b))
    star = [summed(parts.b[j].scaled(-inverse[i][j]) for j in n) for i in n]
    return star, summed((parts.b[i] * star[i]).scaled(Fraction(1, 2)) for i in n)


def _without_opposite_steps(U: Expr) -> Expr:
    """Write step(-g) as 1 - step(g) where both occur: they change at one surface."""
    steps = sorted((a for a in U.all_atoms if a.kind == STEP), key=lambda a: a.order)
    for k, step in enumerate(steps):
        opposite = atom(STEP, -step.inner, step.extra)
        if opposite in steps[k + 1 :]:
            # The energy is continuous there, so their values at g = 0 do not matter.
            U = substituted(U, {opposite: 1 - only(step)})
    return U


def _by_half_angles(U: Expr) -> Expr:
    """Write poles at 1 + cos θ = 0 by the half angle, whose cosine has one sign: 2 cos² ½θ."""
    for k, half in HALVES.items():
        pole = atom(LET, 1 + variable(k).cos())
        with_pole = Expr(
            {m: c for m, c in U.terms.items() if any(a is pole and p < 0 for a, p in m)}
        )
        if with_pole.terms:
            given = {atom(COS, variable(k)): 2 * only(half) ** 2 - 1}
            U = U - with_pole + spread(substituted(with_pole, given))
    return U


def _poles(U: Expr) -> set[int]:
    """Return the angles at whose ends a barrier is: U rises to infinity there."""
    places = {COSINE: 1} | {half: k for k, half in HALVES.items()}
    inside = {a for b in U.all_atoms if b.kind != VAR for a in _divisors(b.inner)}
    poles = set[int]()
    # With d = cos θ2, or cos ½θ, that is so if the term with the lowest power of d is c·d^-n with a
    # number c > 0, and d is the divisor of no other function.
    for d in (_divisors(U) - inside) & places.keys():
        least = min(p for m in U.terms for a, p in m if a is d)
        leading = {m: c for m, c in U.terms.items() if (d, least) in m}
        if leading.get(((d, least),), 0) > 0 and len(leading) == 1:
            poles.add(places[d])
    return poles


def _divisors(e: Expr) -> set[Atom]:
    return {a for m in e.terms for a, p in m if p < 0}
