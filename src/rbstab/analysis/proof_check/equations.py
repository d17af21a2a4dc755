"""Compare the reduced energy of a proof with the equations of a system, at some points.

The equations are evaluated in balls, and the minimum over x = [X, D] is computed from their values
alone. So a mistake in the exact polynomials of the prover would show here.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import cycle, pairwise, product, starmap
from types import MappingProxyType
from typing import Any

import numpy as np
from flint import arb, arb_mat

from rbstab.analysis.configuration import Configurations, configurations
from rbstab.analysis.exact import decimal_balls, in_balls
from rbstab.analysis.proof_check.energy import Energy
from rbstab.analysis.proof_check.guards import SwitchingGuard
from rbstab.analysis.proof_check.lengths.free_ligaments import FreeLigaments
from rbstab.analysis.proof_check.lengths.ligaments import LigamentLaw
from rbstab.analysis.proof_check.trigonometric import Ball
from rbstab.elements.guards.soft_guards import SoftGuard
from rbstab.elements.guards.stop import Stop
from rbstab.elements.ligament import Ligament
from rbstab.mechanics import point
from rbstab.mechanics.numbers import Array
from rbstab.systems.system import System

POINTS = tuple((0.37 * k - 1.9, 0.21 * k - 1.0, 1.7 - 0.43 * k) for k in range(9))
"""Θ at which both are compared, rad."""

FURTHER = tuple(tuple(0.97 * end * (k / 4 - 1) for k in range(9)) for end in (3.1, 1.5, 3.1))
"""Further angles by axis, rad: where a switch has one sign at all points above."""

SHIFTS = ((0.1, -0.2, 0.05), (-0.3, 0.0, 0.2))
"""z at which both are compared, m."""

OWN_SHIFTS = (
    (0.0, 0.0),
    (0.1, -0.031, 0.057, 0.0, -0.083, 0.019, 0.043),
    (-0.07, 0.02, -0.045, 0.091, 0.013, -0.028, -0.064, 0.036),
)
"""How far from the lowest point energies with own states are compared: the entries of D in turn."""

CLOSE = 1e-6
"""A value that is known to no more than this share shows nothing."""

GUARD_SHARES = (0.2, 0.5, 0.9)
"""Where the energies of guards are compared between two angles, from one to the other."""

SHARES = (0.5, 1.5, 3.0, 6.0)
"""Strains at which the laws of ligaments are compared, in units of ε_t. The toe ends at 2."""


def agrees_with_equations(
    energy: Mapping[str, Any], exact_system: Callable[[Callable[[Array], Array]], System]
) -> bool:
    """Return whether U has the values that follow from the equations.

    Args:
        energy: `reduced_energy` of a proof.
        exact_system: Builds the system in a kind of number from the doubles of its config.
    """

    def compare() -> bool:
        U, system = Energy(energy), exact_system(decimal_balls)
        if not _guards_agree(U.guards, system):
            return False
        at_rest = configurations(_without_switching_guards(system))
        if not _laws_agree(U.laws, _ligaments(at_rest.system)):
            return False
        if U.position is not None:
            return _agrees_at_shifts(U, U.position, at_rest)
        points = [[arb(angle) for angle in Theta] for Theta in POINTS]
        points += _beyond_switches(U, at_rest, points)
        if U.own_states:
            return _agrees_at_own_states(U, at_rest, points)
        pairs = ((least_energy(at_rest, Theta), U.value(Theta)) for Theta in points)
        return all(starmap(agree, pairs))

    return bool(in_balls(compare))


def _beyond_switches(
    U: Energy, at_rest: Configurations, points: Sequence[Sequence[Ball]]
) -> list[list[Ball]]:
    """Return points beyond switches of elements of users, on the sides that have no point yet.

    These are the switches of U, and those of the equations.
    """
    users = [one for one in at_rest.system.elements if one.from_user and one.mode_count]
    none = np.array([arb(0)] * (at_rest.size - 3), dtype=object)

    def sides(Theta: Sequence[Ball]) -> set[tuple[int, bool]]:
        values = [value for one in U.of_users for value in one.switches(Theta)]
        motion = at_rest.motion(np.array([*Theta, *none], dtype=object))
        for one in users:
            values += list(one.guards(motion, np.array([arb(0)] * one.state_size, dtype=object)))
        return {(place, bool(value > 0)) for place, value in enumerate(values)}

    seen = {side for Theta in points for side in sides(Theta)}
    if not seen:
        return []
    found = list[list[Ball]]()
    for angles in product(*FURTHER):
        Theta = [arb(angle) for angle in angles]
        if not sides(Theta) <= seen:
            seen |= sides(Theta)
            found.append(Theta)
    return found


def _without_switching_guards(system: System) -> System:
    """Return a system without the guards whose energies are compared by themselves."""
    others = [one for one in system.elements if not isinstance(one, SoftGuard | Stop)]
    return replace(system, elements=tuple(others))


def _guards_agree(guards: Sequence[SwitchingGuard], system: System) -> bool:
    """Return whether the soft guards of a system have these energies, and its stop this angle.

    The energies are compared at some angles between all θ_s, those of the proof too, and beyond the
    last: they are polynomials of degree 2 there.
    """
    soft = [one for one in system.elements if isinstance(one, SoftGuard)]
    stops = [arb(0) + one.angle for one in system.elements if isinstance(one, Stop)]
    stated = min(stops, key=float, default=None)
    found = next((one.angle for one in guards if one.couple is None), None)
    if (stated is None) != (found is None) or (found is not None and not found.overlaps(stated)):
        return False
    end = arb.pi() / 2 if stated is None else stated
    known = [one.angle for one in guards if one.couple is not None]
    if not all(one < end for one in known):
        return False
    begins = sorted([arb(0), *known, *(arb(0) + one.soft_angle for one in soft)], key=float)
    for begin, after in pairwise([*(one for one in begins if one < end), end]):
        for share in GUARD_SHARES:
            angle = begin + share * (after - begin)
            if not (begin < angle < after):
                continue  # two guards with one angle
            for pitch in (angle, -angle):
                energy = sum((_stated_energy(one, pitch) for one in soft), arb(0))
                if not energy.overlaps(sum((one.energy(pitch) for one in guards), arb(0))):
                    return False
    return True


def _stated_energy(guard: SoftGuard, pitch: Ball) -> Ball:
    """Return the energy that a soft guard states at an angle θ2."""
    mode = np.array([float(pitch > guard.soft_angle), float(-pitch > guard.soft_angle)])
    return arb(0) + replace(guard, mode=mode).energy(pitch)


def _ligaments(system: System) -> list[Ligament]:
    """Return the ligaments of a system; those of a proof have the same order."""
    return [one for one in system.elements if isinstance(one, Ligament)]


def _laws_agree(laws: Sequence[LigamentLaw], ligaments: Sequence[Ligament]) -> bool:
    """Return whether ligaments have the energies of these laws in the toe and beyond it.

    A ligament may be slack, or beyond its toe, at all Θ at which U is compared.
    """
    if len(laws) != len(ligaments):
        return False
    for law, ligament in zip(laws, ligaments, strict=True):
        for share in SHARES:
            strain = law.toe * share
            mode = np.array([1.0, float(share > 2)])
            stated = replace(ligament, mode=mode).energy(strain)
            length = law.slack_length * (1 + strain)
            if not law.derivatives(length)[0].overlaps(arb(0) + stated):
                return False
    return True


def _agrees_at_shifts(U: Energy, V: FreeLigaments, at_rest: Configurations) -> bool:
    """Return whether U + ½ z'Sz + Σ Φ_j is the stored energy with the least energy over D.

    z counts from X*(Θ), which follows from a ligament: its end is X + A p - anchor by the
    equations, z + r(Θ) by the proof.
    """
    ligaments = _ligaments(at_rest.system)
    own = at_rest.size - at_rest.pose_size
    for Theta in POINTS:
        angles = [arb(angle) for angle in Theta]
        q = np.array([*angles, *[arb(0)] * (3 + own)], dtype=object)
        end = point.position(at_rest.motion(q), ligaments[0].point) - ligaments[0].anchor
        r = [entry.derivatives(angles)[()] for entry in V.ligaments[0].offset]
        others = U.value(angles)
        for shift in SHIFTS:
            z = [arb(entry) for entry in shift]
            X = [one - other + entry for one, other, entry in zip(r, end, z, strict=True)]
            found = others + V.energy_at(angles, z)
            if not agree(least_energy(at_rest, [*angles, *X]), found):
                return False
    return True


def _agrees_at_own_states(
    U: Energy, at_rest: Configurations, points: Sequence[Sequence[Ball]]
) -> bool:
    """Return whether U without its least energies over own states D, plus f(Θ, D), is right.

    It is the stored energy with these D, and the least one over all else.
    """
    places = _own_entries(at_rest)
    if any(one.count != len(places.get(one.name, ())) for one in U.own_states):
        return False
    for Theta in points:
        others, lowest = U.value_of_others(Theta), [one.near_lowest(Theta) for one in U.own_states]
        for shifts in OWN_SHIFTS:
            found, own, shift = others, dict[int, Ball](), cycle(shifts)
            for one, D in zip(U.own_states, lowest, strict=True):
                if D is None:
                    return False
                # No two entries are shifted alike, so that no f depends on all of them together.
                moved = [entry + next(shift) for entry in D]
                own |= dict(zip(places[one.name], moved, strict=True))
                found += one.stored(Theta, moved)
            if not agree(least_energy(at_rest, Theta, own), found):
                return False
    return True


def agree(stated: Ball, found: Ball) -> bool:
    """Return whether two values agree: a ball without a bound, or a wide one, shows nothing."""
    known = stated.is_finite() and found.is_finite()
    return bool(
        known and found.rad() <= CLOSE * (1 + abs(found)).upper() and stated.overlaps(found)
    )


def _own_entries(at_rest: Configurations) -> dict[str, range]:
    """Return the entries of q that are the own states of each element."""
    found, begin = dict[str, range](), at_rest.pose_size
    for element in at_rest.system.elements:
        found[element.name] = range(begin, begin + element.state_size)
        begin += element.state_size
    return found


def least_energy(
    at_rest: Configurations, fixed: Sequence[Ball], own: Mapping[int, Ball] = MappingProxyType({})
) -> Ball:
    """Return the least stored energy over the entries x of q that are not fixed.

    It is quadratic in them: e = c + b'x + ½ x'Hx.

    Args:
        at_rest: The configurations q of the system.
        fixed: The first entries of q: Θ, or Θ and X.
        own: Further entries that are fixed, by their places.
    """
    left = [place for place in range(len(fixed), at_rest.size) if place not in own]
    size = len(left)

    def energy(*places: int) -> Ball:
        """Return e with 1 added to the entries of x at these places."""
        q = np.array([*fixed, *[arb(0)] * (at_rest.size - len(fixed))], dtype=object)
        for place, value in own.items():
            q[place] = value
        for place in places:
            q[left[place]] += 1
        return arb(0) + at_rest.energy(q)

    c = energy()
    if size == 0:
        return c
    single = [energy(i) - c for i in range(size)]
    rows = [[energy(i, j) - c - single[i] - single[j] for j in range(size)] for i in range(size)]
    b = arb_mat([[single[i] - rows[i][i] / 2] for i in range(size)])
    return c - (b.transpose() * arb_mat(rows).inv() * b)[0, 0] / 2
