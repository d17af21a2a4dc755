"""Whether an element of a user is passive, and whether proofs may take it into account.

Its energy must be a function of the pose and of its own states with

    d(stored)/dt + dissipated + (power of the wrench) = 0,        dissipated >= 0,

for all motions, and its wrench and rates must have values for all of them. At rest its own states D
must move down its energy W: dD/dt = -M ∂W/∂D with a constant M, M + M' positive definite. Or each
(∂W/∂D_i) dD_i/dt is never positive by its form, and zero only where ∂W/∂D_i is, as for
dD_i/dt = -sinh(∂W/∂D_i).
"""

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from rbstab.analysis.configuration import Configurations, configurations
from rbstab.elements.element import Element
from rbstab.proof.boxes import Box, as_boxes
from rbstab.proof.enclosures.bounds import BoundedEnergy
from rbstab.proof.exact.atoms import COS, SIN, VAR
from rbstab.proof.exact.expr import Expr, as_factor, atom, expr, only, summed, variable, variable_of
from rbstab.proof.exact.matrices import inverse_of_definite
from rbstab.proof.exact.rewriting import derivative, quadratic_in, substituted
from rbstab.proof.passive.expanded import TooLargeError, is_zero, multiplied_out
from rbstab.proof.passive.signs import (
    PITCH,
    in_terms_of,
    is_convex,
    never_negative,
    positive,
    spanned,
    vanishing,
)
from rbstab.proof.passive.statements import (
    TIME,
    VELOCITIES,
    NotRecordedError,
    Stated,
    Statements,
    sides,
    statements_of,
)
from rbstab.proof.passive.switches import MOST_MODES, force_is_continuous, why_not_continuous
from rbstab.systems.system import System

TIMED = "a statement depends on the time"

NO_FUNCTION_OF_POSE = "`stored` depends on a velocity"

UNBALANCED = "it is not shown that `wrench` has the power that `stored` and `dissipated` state"

WITHOUT_VALUES = (
    "it is not shown that `stored`, `wrench` and `dissipated` have values for all motions: a "
    "divisor, or what a root or a logarithm is taken of, may be zero"
)

GUARDS_WITHOUT_VALUES = "it is not shown that its event functions have values at all attitudes"

GAINS_ENERGY = "it is not shown that `dissipated` is never negative"

NOT_QUADRATIC = (
    "it is not shown that its energy is a quadratic function of X and its own states, with "
    "constant second derivatives"
)

NOT_CONVEX_IN_STATES = (
    "it is not shown that its energy is convex in its own states, as sums of even powers of "
    "displacements are"
)

NO_LEAST_ENERGY = (
    "at some attitude no least energy over its own states is found, at which the second "
    "derivatives are positive definite"
)

MOST_STATES = 6
"""Bounds on the least energy over more own states would take very long."""

TOO_MANY_STATES = f"its energy is not quadratic, and it has more than {MOST_STATES} own states"

NOT_CONVEX = (
    "it is not shown that its energy is a quadratic function of X, or convex in X, as sums of even "
    "powers of displacements are"
)

NOT_RELAXING = (
    "it is not shown that its own states move down its energy while the body is at rest: `rates` "
    "must be -M times the derivative of `stored` then, with a constant positive definite M, or "
    "each rate must have the sign of minus its own derivative by its form"
)

TOO_LARGE = "its energy has too many terms, or too large numbers"

UNUSUAL = (
    f"it has more than {MOST_MODES} switches, a stop or an energy at rest of its own, or depends "
    "on the time"
)

BOX_LIMIT = 20_000
"""The boxes over which the bounds of one argument are computed at most."""

TAGS = 5000
"""The number of the first variable that stands for another expression."""

END = np.nextafter([np.pi, np.pi / 2, np.pi], np.inf)

SOME_ATTITUDES = np.stack(
    [
        grid.ravel()
        for grid in np.meshgrid([-2.4, -0.8, 0.8, 2.4], [-1, 0, 1], [-2.4, -0.8, 0.8, 2.4])
    ]
)
"""rad; the attitudes at which a least energy over own states must be found."""


def in_proofs(element: Element) -> bool:
    """Return whether proofs may take an element of a user into account."""
    plain = element.mode_count <= MOST_MODES and not element.clearance_count
    usual = type(element).at_rest is Element.at_rest and not (element.holds or element.slides)
    return plain and usual and not element.timed


def why_not_in_proofs(system: System) -> str | None:
    """Return why proofs do not take an element of a user into account; None if they take all.

    The reason begins with the name of the element.

    Args:
        system: The system, in doubles.
    """
    at_rest = configurations(system)
    for element in at_rest.system.elements:
        if not element.from_user:
            continue
        why = _why_not(at_rest, element) if in_proofs(element) else UNUSUAL
        if why is not None:
            return f"{element.name}: {why}"
    return None


def _why_not(at_rest: Configurations, element: Element) -> str | None:
    """Return the first thing that is not shown of an element; None if all is."""
    try:
        statements = statements_of(at_rest, element)
    except NotRecordedError as error:
        return f"its code cannot be recorded: {error}"
    checks = _why_unbalanced, why_not_continuous, _why_no_values, _why_moving_up
    return _first(statements, *checks, _why_no_least_energy)


def why_not_passive(statements: Statements) -> str | None:
    """Return what is not shown of an element that should be passive, or None if all is."""
    return _first(statements, _why_unbalanced)


def _first(statements: Statements, *checks: Callable[[Statements], str | None]) -> str | None:
    """Return the reason of the first check that gives one."""
    try:
        return next((why for check in checks if (why := check(statements)) is not None), None)
    except ZeroDivisionError:  # with one of the values of a mode
        return WITHOUT_VALUES
    except (RecursionError, OverflowError):
        return TOO_LARGE


def _why_unbalanced(statements: Statements) -> str | None:
    of = statements.of_motion
    if any(TIME in e.variables for e in of.used):
        return TIMED
    if not of.stored.variables.isdisjoint(VELOCITIES):
        return NO_FUNCTION_OF_POSE
    if not statements.on_all_sides(is_zero, _balance(statements)):
        return UNBALANCED
    forms = statements.of_any, of
    if not any(statements.on_all_sides(_have_values, *form.used) for form in forms):
        return WITHOUT_VALUES
    dissipated = [form.dissipated for form in forms]
    if not any(statements.on_all_sides(never_negative, power) for power in dissipated):
        return GAINS_ENERGY
    return None


def _balance(statements: Statements) -> Expr:
    """Return d(stored)/dt + dissipated + (power of the wrench), which must be zero."""
    of: Stated = statements.of_motion
    motion, (force, couple, contact_force) = of.motion, np.split(np.array(of.wrench), 3)
    power = force @ motion.V + couple @ motion.Omega
    rates = dict(enumerate(map(expr, motion.B @ motion.Omega)))
    if not statements.held:  # else a force at the contact point has no power
        power = power + contact_force @ motion.F
        rates |= dict(enumerate(map(expr, motion.V), start=3))
    rates |= dict(zip(statements.state_numbers, of.rates, strict=True))
    balance: Expr = derivative(of.stored, rates) + of.dissipated + power
    return balance


# -- values ----------------------------------------------------------------------------------------


def _have_values(*of: Expr) -> bool:
    """Return whether expressions are shown to have values, and to be smooth."""
    functions = {a for e in of for a in e.all_atoms if a.kind != VAR}
    above = {a.inner for a in functions if a.kind in {"sqrt", "log"}}
    sums = (*of, *(a.inner for a in functions))
    divisors = {a for e in sums for m in e.terms for a, p in m if p < 0 and a.kind != "sqrt"}
    return all(positive(e) or _by_boxes(e, either=False) for e in above) and all(
        positive(e) or positive(-e) or _by_boxes(e, either=True) for e in map(only, divisors)
    )


def _by_boxes(e: Expr, *, either: bool) -> bool:
    """Return whether an expression of Θ is above zero at all |θ2| <= π/2, or has one sign."""
    if not (e.variables <= {0, 1, 2} and _is_periodic(e)):
        return False
    V, boxes, examined = BoundedEnergy(e, least={PITCH: 0.0}, order=2), as_boxes(Box(-END, END)), 0
    while boxes.count:
        examined += boxes.count
        if examined > BOX_LIMIT:
            return False
        value = V.over(*boxes).value_over
        boxes = boxes[~((value.lo > 0) | (either & (value.hi < 0)))]
        boxes = boxes.halved((boxes.hi - boxes.lo).argmax(axis=0))
    return True


def _is_periodic(e: Expr) -> bool:
    """Return whether θ1 and θ3 stand in their sines and cosines alone."""
    return all(
        (a.kind in {SIN, COS} and variable_of(a.inner) is not None)
        or (a.kind != VAR and _is_periodic(a.inner))
        or a.variables <= {1}
        for a in e.atoms
    )


# -- switches and the form of the energy -----------------------------------------------------------


def _why_no_values(statements: Statements) -> str | None:
    return None if _have_values(*statements.of_motion.guards) else GUARDS_WITHOUT_VALUES


def first_jump(at_rest: Configurations, element: Element) -> int:
    """Return the order of the first derivative of the energy of an element that may jump.

    It is 2 if its force is shown to be continuous at its switches, else 1.

    Args:
        at_rest: The configurations of its system, in doubles.
        element: One of the elements of this system, of a user.
    """
    try:
        statements = statements_of(at_rest, element)
    except NotRecordedError:
        return 1
    shown = _first(statements, _why_unbalanced, why_not_continuous, _why_no_values) is None
    return 2 if shown and force_is_continuous(statements) else 1


def _why_no_least_energy(statements: Statements) -> str | None:
    """Return why the energy is not known to have one least value over X and own states."""
    state_numbers, held = statements.state_numbers, statements.held
    x = [*(() if held else range(3, 6)), *state_numbers]
    stored = statements.of_motion.stored
    rest = quadratic_in(stored, x, constant=(VAR, SIN, COS)).rest
    if rest.variables.isdisjoint(x):
        return None
    if state_numbers and not held:
        return NOT_QUADRATIC
    forms = (statements.of_any.stored,), (rest, stored - rest)
    if not any(statements.on_all_sides(partial(_are_convex, x), *form) for form in forms):
        return NOT_CONVEX_IN_STATES if state_numbers else NOT_CONVEX
    if not state_numbers:
        return None
    if len(state_numbers) > MOST_STATES:
        return TOO_MANY_STATES
    has_least = all(
        _is_least_somewhere(e, state_numbers) for (e,) in sides([stored], statements.modes)
    )
    return None if has_least else NO_LEAST_ENERGY


def _are_convex(x: Sequence[int], *of: Expr) -> bool:
    return all(is_convex(e, x) for e in of)


def _is_least_somewhere(stored: Expr, state_numbers: Sequence[int]) -> bool:
    """Return whether a lowest point over own states is found at some attitudes."""
    energy = BoundedEnergy(stored, free=state_numbers, order=2)
    with np.errstate(all="ignore"):
        z = energy.minimiser(SOME_ATTITUDES).z
        _, slope, H = energy.at_all(SOME_ATTITUDES, z)
        slope, H = slope[3:], np.moveaxis(H[3:, 3:], -1, 0)
        size = np.abs(H).max(axis=(1, 2)) * (1 + np.abs(z).max(axis=0))
        if not (np.isfinite(H).all() and np.all(np.abs(slope).max(axis=0) < 1e-6 * size)):
            return False
        return bool(np.linalg.eigvalsh(H)[:, 0].min() > 0)


# -- own states ------------------------------------------------------------------------------------


def _why_moving_up(statements: Statements) -> str | None:
    """Return why the own states may not move down the energy of a body at rest; None if they do."""
    state_numbers, of = statements.state_numbers, statements.of_motion
    still = {atom(VAR, k): expr(0) for k in VELOCITIES}
    rates = [substituted(rate, still) for rate in of.rates]
    both = sides([of.stored, *rates], statements.modes) if state_numbers else ()
    return None if all(moves_down(W, state_numbers, rates) for W, *rates in both) else NOT_RELAXING


def moves_down(stored: Expr, state_numbers: Sequence[int], rates: Sequence[Expr]) -> bool:
    """Return whether rates are -M times the slopes of an energy, or each has the sign of -slope.

    Args:
        stored: The energy.
        state_numbers: The numbers of the variables D.
        rates: dD/dt.
    """
    slopes = [derivative(stored, {k: expr(1)}) for k in state_numbers]
    tags = [variable(TAGS + k) for k in range(2 * len(slopes))]
    both = zip((*slopes, *rates), tags, strict=True)
    try:
        total = multiplied_out(summed(e * tag for e, tag in both))
    except TooLargeError:
        return False
    columns = [derivative(total, {TAGS + k: expr(1)}) for k in range(len(tags))]
    M = in_terms_of(columns[: len(slopes)], columns[len(slopes) :])
    if M is None:
        return all(map(_has_sign, rates, slopes, state_numbers))
    n = range(len(state_numbers))
    return inverse_of_definite([[-M[i][j] - M[j][i] for j in n] for i in n]) is not None


def _has_sign(rate: Expr, slope: Expr, number: int) -> bool:
    """Return whether rate·slope is never positive, and zero only where the slope is."""
    s, parts = variable(TAGS), quadratic_in(slope, [number], constant=(VAR, SIN, COS))
    a, D = parts.b[0].constant, variable(number)
    b = slope - parts.b[0] * D
    # If the slope is s = a D + b with a constant a, it takes the place of D.
    if a and number not in b.variables:
        rate, slope = substituted(rate, {atom(VAR, number): (s - b).scaled(1 / a)}), s
    power = as_factor(slope) * -rate
    return bool(slope.terms) and never_negative(power) and spanned([slope], vanishing(power))
