"""The guards of a system, taken apart from all else."""

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction

from rbstab.analysis.proof.guards.barrier import BarrierEnergy
from rbstab.analysis.proof.guards.guard import Guard
from rbstab.analysis.proof.guards.soft import soft_energies, stop_energy
from rbstab.analysis.proof.polynomial import exact_number
from rbstab.elements.element import Element
from rbstab.elements.guards.barrier import Barrier
from rbstab.elements.guards.soft_guards import SoftGuard
from rbstab.elements.guards.stop import Stop
from rbstab.systems.system import System

GUARDS = (Barrier, SoftGuard, Stop)

SWITCHING_GUARDS = (SoftGuard, Stop)


class NotInProofsError(Exception):
    """A guard has a negative energy, which no proof takes into account."""


def guards_apart(system: System) -> tuple[System, list[Element]]:
    """Return a system without its guards, and the guards."""
    guards: list[Element] = [one for one in system.elements if isinstance(one, GUARDS)]
    others = tuple(element for element in system.elements if not isinstance(element, GUARDS))
    return replace(system, elements=others), guards


def has_switching_guards(system: System) -> bool:
    """Return whether a system has a soft guard or a stop."""
    return any(isinstance(element, SWITCHING_GUARDS) for element in system.elements)


def guard_of(guards: Sequence[Element]) -> Guard | None:
    """Return the sum of the energies of guards, whose parameters are exact; None if it is zero.

    Raises:
        NotInProofsError: One of them has an energy that no proof takes into account.
    """
    barriers = [one for one in guards if isinstance(one, Barrier)]
    barrier = _sum_of([exact_number(one.stiffness) for one in barriers], half=False)
    outer = _sum_of([exact_number(one.outer_stiffness) for one in barriers], half=True)
    soft = [one for one in guards if isinstance(one, SoftGuard)]
    stops = [exact_number(one.angle) for one in guards if isinstance(one, Stop)]
    if not stops:
        parts = soft_energies(soft)
    else:
        # A guard that begins beyond the stop, or at it, never acts.
        acting = [one for one in soft if exact_number(one.soft_angle) < min(stops)]
        parts = (*soft_energies(acting), stop_energy(min(stops)))
    acts = barrier is not None or parts or outer is not None
    return Guard(barrier, parts, outer) if acts else None


def _sum_of(stiffnesses: Sequence[Fraction], *, half: bool) -> BarrierEnergy | None:
    """Return the sum of barriers on one angle; None if it is zero."""
    if any(stiffness < 0 for stiffness in stiffnesses):
        raise NotInProofsError
    return BarrierEnergy(float(sum(stiffnesses)), half) if any(stiffnesses) else None
