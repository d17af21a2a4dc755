"""The reduced potential energy: the stored energy at an attitude, minimized over all else."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from rbstab.analysis.configuration import Configurations, configurations
from rbstab.analysis.exact import is_positive_definite
from rbstab.analysis.proof.formulas.polynomials import polynomial_of
from rbstab.analysis.proof.guards.guard import Guard
from rbstab.analysis.proof.guards.separate import NotInProofsError, guard_of, guards_apart
from rbstab.analysis.proof.ligaments.free import FreeLigament, FreeLigaments
from rbstab.analysis.proof.ligaments.held import LigamentLine
from rbstab.analysis.proof.ligaments.law import LigamentEnergy
from rbstab.analysis.proof.ligaments.separate import laws_of, ligaments_apart, squares_of
from rbstab.analysis.proof.lines.line import LinePart
from rbstab.analysis.proof.lines.separate import lengths_apart, separated_lines, trimmed
from rbstab.analysis.proof.lines.shortest import NoLength
from rbstab.analysis.proof.multiple_angles import (
    LARGEST,
    SMALLEST,
    NotTrigonometric,
    form_of,
    has_size,
)
from rbstab.analysis.proof.polynomial import Polynomial, Ring, fraction
from rbstab.analysis.proof.position import offset, position_spring
from rbstab.analysis.proof.traced.separate import (
    ConvexInStates,
    UserEnergies,
    entries_without_users,
    in_proofs,
    user_energies,
    without_users,
)
from rbstab.analysis.proof.traced.separate import NotInProofsError as NotInProofsOfUsersError
from rbstab.analysis.proof.trigonometric import TrigonometricForm
from rbstab.elements.sliding import SlidingConnector
from rbstab.elements.spring import Spring
from rbstab.mechanics.numbers import Array
from rbstab.systems.modes import has_modes
from rbstab.systems.parameters import map_parameters
from rbstab.systems.system import System

if TYPE_CHECKING:
    from flint import fmpq


class NoEnergyReason(Enum):
    """Why a system has no reduced potential energy; the value is the text to show."""

    NO_POTENTIAL = "the connector's force on the surface s = F + κE has no potential"
    NOT_SMOOTH = "the energy K_s|E| of the sliding connector has no gradient at E = 0"
    SWITCHES = "an element switches, so its energy is not one formula for all attitudes"
    SUPPLIES = "an input supplies power"
    USER_CODE = (
        "an element is code of a user, and proofs take it into account only if it has at most 6 "
        "switches, and no stop of its own"
    )
    NOT_IN_PROOFS = "no proof takes this code of a user into account"
    NOT_HELD = "nothing holds the position: the energy has no single minimum over X and D"
    NOT_QUADRATIC = "the energy is not a quadratic function of X and D with constant stiffness"
    NOT_FINITE = (
        f"a number of the energy is too small or too large: proofs take {SMALLEST:g} to {LARGEST:g}"
        " in SI units"
    )
    NOT_TRIGONOMETRIC = (
        "the energy is not a quadratic function of Θ plus a polynomial in its sines and cosines"
    )
    NO_LENGTH = (
        "the line of a spring may have no length at some attitude, and then its force no direction"
    )
    SIX_VARIABLES = "the body is not held, and its energy is no quadratic function of X"
    STOP_IN_SIX = (
        "the body is not held, and no proof takes springs, or elements of users whose energy is no "
        "quadratic function of X, beside a stop into account then"
    )


SEARCHED_INSTEAD = frozenset(
    {
        NoEnergyReason.USER_CODE,
        NoEnergyReason.NOT_IN_PROOFS,
        NoEnergyReason.NOT_QUADRATIC,
        NoEnergyReason.NOT_TRIGONOMETRIC,
        NoEnergyReason.NO_LENGTH,
        NoEnergyReason.STOP_IN_SIX,
    }
)
"""The reasons for which nothing is proved of rest states that can be looked for."""


ExactSystem = Callable[[Callable[[Array], Array]], System]
"""A function that builds a system in a kind of number, given the conversion of its doubles."""


class NoReducedEnergy(Exception):
    """A system has no reduced potential energy; `reason` names the reason."""

    def __init__(self, reason: NoEnergyReason, detail: str | None = None) -> None:
        super().__init__(reason.value if detail is None else f"{reason.value}: {detail}")
        self.reason = reason


@dataclass(frozen=True, eq=False)
class ReducedEnergy:
    """U(Θ) = min over x of Π(Θ, x), with x = [X, D] (x = D if the contact point is held).

    Π, the stored energy, is quadratic in x, so x* = -H⁻¹b(Θ) and U = Π(Θ, 0) - ½ b'H⁻¹b. Zeros of
    ∂U/∂Θ and rest states correspond one to one.

    configurations are the system's configurations. form is U. minimizer has the entries of x*.
    The energy of a guard is a function of θ2 alone: it is that of the form, and x* does not depend
    on it.

    With ligaments of a body that is not held, minimizer is x* without them. Then X* is their shift
    z more, and D* is `own` z less: own is H_DD⁻¹H_DX, shape (own states, 3).

    own_states are elements of users whose energy is convex in own states, and not quadratic. The
    minimizer has zeros for them.
    """

    configurations: Configurations
    form: TrigonometricForm
    minimizer: tuple[TrigonometricForm, ...]
    ligaments: FreeLigaments | None = None
    own: Array = field(default_factory=lambda: np.zeros((0, 3)))
    own_states: tuple[ConvexInStates, ...] = ()

    def configuration(self, Theta: Array) -> Array:
        """Return q = [Θ, x*(Θ)], shape (size,)."""
        x = np.array([form.value(Theta[np.newaxis])[0] for form in self.minimizer])
        if self.ligaments is not None:
            z = self.ligaments.shift(Theta[np.newaxis])[0]
            x = np.concatenate([x[:3] + z, x[3:] - self.own @ z])
        for entries, least in self.own_states:
            x[entries.start : entries.stop] = least.lowest(Theta[np.newaxis])[0]
        return np.concatenate([Theta, x])


def reduced_energy(system: System, exact_system: ExactSystem | None = None) -> ReducedEnergy:
    """Compute the reduced potential energy of a system from the stored energies of its elements.

    The stored energy is an exact polynomial, so the elimination of x is exact as well.

    Args:
        system: The system, in doubles.
        exact_system: Builds the same system in another kind of number, from the numbers of its
            config. Then U belongs to the decimals that these numbers mean, and all that follows
            from them, such as the weight, is exact. By default the doubles of `system` are exact.

    Raises:
        NoReducedEnergy: The system has none, or it does not have the supported form.
    """
    reject_unsmooth(system)
    at_rest = configurations(system)
    try:
        users = user_energies(at_rest)
        if users.of_position:
            raise NoReducedEnergy(NoEnergyReason.SIX_VARIABLES)
        parts = _stored_energy(at_rest, exact_system, users, roots=0)
        if not parts.energy.known:
            # At most one length for each element; a ring without them is faster.
            parts = _stored_energy(at_rest, exact_system, users, roots=len(system.elements))
        least = [one.least for one in users.own_states]
        found = _reduced(at_rest, parts, (*users.traced, *users.kinked, *least))
        return replace(found, own_states=users.own_states)
    except NotInProofsOfUsersError as error:
        raise NoReducedEnergy(NoEnergyReason.NOT_IN_PROOFS, str(error)) from error
    except NotTrigonometric as error:
        raise NoReducedEnergy(NoEnergyReason.NOT_TRIGONOMETRIC) from error
    except OverflowError as error:
        raise NoReducedEnergy(NoEnergyReason.NOT_FINITE) from error


class StoredEnergy(NamedTuple):
    """The stored energy Π of a system in its parts, exactly.

    Attributes:
        energy: All of it but what follows.
        guard: The sum of the guards of θ2; None without one.
        ligaments: The squares of the lengths of the ligaments, and their energies.
    """

    energy: Polynomial
    guard: Guard | None
    ligaments: tuple[tuple[Polynomial, LigamentEnergy], ...]


def stored_energy(
    system: System, ring: Ring, users: UserEnergies, entries: Sequence[int]
) -> StoredEnergy:
    """Return the stored energy of a system whose parameters are exact numbers of a ring.

    Args:
        system: The system, without its elements of users.
        ring: The ring.
        users: The energies of these elements; what only programs compute is left out.
        entries: The entries of q that belong to the system (`entries_without_users`).

    Raises:
        NotTrigonometric: The length of a ligament is no polynomial.
        NoReducedEnergy: A guard has an energy that no proof takes into account.
    """
    without, guards = guards_apart(system)
    without, ligaments = ligaments_apart(without)
    try:
        guard = guard_of(guards)
    except NotInProofsError as error:
        raise NoReducedEnergy(NoEnergyReason.NOT_TRIGONOMETRIC) from error
    at_rest = Configurations(without)
    energy: Any = at_rest.energy(ring.variables()[list(entries)])
    if not isinstance(energy, Polynomial):
        energy = ring.constant(energy)
    for program in users.polynomials:
        added = polynomial_of(program, ring)
        assert added is not None  # it is one in any ring of Θ and x
        energy = energy + added
    for own, _ in users.own_states:
        # They are least by themselves; here they are zero, and add nothing.
        energy = energy + sum(x * x for x in ring.variables()[3:][own.start : own.stop])
    squares = squares_of(at_rest, ligaments, ring)
    return StoredEnergy(
        energy,
        guard,
        tuple(zip(squares, laws_of(ligaments), strict=True)),
    )


def _stored_energy(
    at_rest: Configurations, exact_system: ExactSystem | None, users: UserEnergies, roots: int
) -> StoredEnergy:
    """Return Π in a ring with square roots."""
    # The lengths of lines depend on X too if the body is free.
    ring = Ring(3, at_rest.size - 3, roots=roots, roots_of_lengths=not at_rest.held)
    if exact_system is None:
        exact = map_parameters(at_rest.system, lambda _, value: ring.constants(value))
    else:
        exact = configurations(exact_system(ring.decimals)).system
    return stored_energy(without_users(exact), ring, users, entries_without_users(at_rest))


def _reduced(
    at_rest: Configurations, parts: StoredEnergy, traced: tuple[LinePart, ...]
) -> ReducedEnergy:
    """Return the reduced energy of a stored energy."""
    energy = parts.energy
    if not energy.known:
        raise NoReducedEnergy(NoEnergyReason.NOT_TRIGONOMETRIC)
    if not at_rest.held:
        energy = _without_lengths(energy)
    try:
        reduced, minimizer = eliminated(energy)
        plain, lines = separated_lines(reduced) if at_rest.held else (reduced, ())
    except NoLength as error:
        raise NoReducedEnergy(NoEnergyReason.NO_LENGTH) from error
    form = replace(form_of(plain), guard=parts.guard, lines=(*lines, *traced))
    rest = tuple(form_of(entry) for entry in minimizer)
    if not parts.ligaments:
        return ReducedEnergy(at_rest, form, rest)
    if at_rest.held:
        held = (LigamentLine(trimmed(form_of(s)), law) for s, law in parts.ligaments)
        return ReducedEnergy(at_rest, replace(form, lines=(*form.lines, *held)), rest)
    spring = position_spring(inverse_stiffness(energy))
    ligaments = tuple(FreeLigament(offset(s, minimizer), law) for s, law in parts.ligaments)
    free = FreeLigaments(spring.stiffness, ligaments)
    return ReducedEnergy(at_rest, replace(form, lines=(*form.lines, free)), rest, free, spring.own)


def _without_lengths(energy: Polynomial) -> Polynomial:
    """Return the energy of a free body whose springs have no rest length: it is quadratic in X."""
    plain, weights = lengths_apart(energy)
    if any(weights):
        raise NoReducedEnergy(NoEnergyReason.SIX_VARIABLES)
    return plain


def reject_unsmooth(system: System) -> None:
    """Raise `NoReducedEnergy` if an element is not smooth, supplies power, or is not in proofs.

    It is also raised if a number of the system is too small or too large for proofs.

    Not smooth are elements that switch or slide, and a damped spring without a rest length. Proofs
    take ligaments, soft guards and stops into account, although they switch.
    """
    held = configurations(system).held
    map_parameters(system, _reject_sizes)
    if not all(in_proofs(one) for one in system.elements if one.from_user):
        raise NoReducedEnergy(NoEnergyReason.USER_CODE)
    if system.supplies:
        raise NoReducedEnergy(NoEnergyReason.SUPPLIES)
    if has_modes(ligaments_apart(guards_apart(without_users(system))[0])[0]):
        raise NoReducedEnergy(NoEnergyReason.SWITCHES)
    for element in system.elements:
        # With a rest length, W has a kink where the line has no length; the proof keeps away from
        # it. Without one, nothing in W shows that the force of the damper has no direction there.
        if isinstance(element, Spring) and element.rest_length == 0 and not held:
            raise NoReducedEnergy(NoEnergyReason.NO_LENGTH)
        if isinstance(element, SlidingConnector):
            on_position = element.rate_weight == 0
            raise NoReducedEnergy(
                NoEnergyReason.NOT_SMOOTH if on_position else NoEnergyReason.NO_POTENTIAL
            )


def _reject_sizes(name: str, value: Array) -> Array:
    """Return a parameter; raise `NoReducedEnergy` if it is too small or too large for proofs."""
    if not has_size(value):
        raise NoReducedEnergy(NoEnergyReason.NOT_FINITE, f"{name} is {value.tolist()}")
    return value


def eliminated(energy: Polynomial) -> tuple[Polynomial, list[Polynomial]]:
    """Return U and x*, with b = ∂Π/∂x at x = 0 and H = ∂²Π/∂x²."""
    lengths = range(energy.ring.lengths)
    bare = energy.length_coefficient()
    if not lengths:
        return bare, []
    compliance = inverse_stiffness(energy)
    b = [energy.length_coefficient(i) for i in lengths]
    minimizer = [-sum((b[j] * compliance[i][j] for j in lengths), start=0 * bare) for i in lengths]
    # Π(Θ, x*) = Π(Θ, 0) + ½ b'x*, because b + Hx* = 0.
    reduced = bare + sum((b[i] * minimizer[i] for i in lengths), start=0 * bare) * 0.5
    return reduced, minimizer


def inverse_stiffness(energy: Polynomial) -> list[list[Polynomial]]:
    """Return H⁻¹, whose entries are constants."""
    from flint import fmpq_mat  # imported late, as in `polynomial`

    if energy.degree > 2:
        raise NoReducedEnergy(NoEnergyReason.NOT_QUADRATIC)
    ring, lengths = energy.ring, range(energy.ring.lengths)
    rows = [[_second_derivative(energy, i, j) for j in lengths] for i in lengths]
    exact = np.array([[fraction(one) for one in row] for row in rows], dtype=object)
    if rows and not is_positive_definite(exact):
        raise NoReducedEnergy(NoEnergyReason.NOT_HELD)
    inverse = fmpq_mat(rows).inv()
    wrapped = ring.context.constant
    return [[Polynomial(ring, wrapped(inverse[i, j])) for j in lengths] for i in lengths]


def _second_derivative(energy: Polynomial, i: int, j: int) -> "fmpq":
    """Return ∂²Π/∂x_i∂x_j: twice the coefficient of x_i², or the coefficient of x_i x_j."""
    value = (energy.length_coefficient(i, j) * (1 + (i == j))).constant_value
    if value is None:
        raise NoReducedEnergy(NoEnergyReason.NOT_QUADRATIC)
    return value
