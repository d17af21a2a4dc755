"""The guards of θ2 of a system, taken apart from all else."""

from collections.abc import Sequence
from dataclasses import replace

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
    """A guard has an energy that no proof takes into account: that of θ1 and θ3, or a negative."""

    def __init__(self, *, outer: bool) -> None:
        super().__init__()
        self.outer = outer


def guards_apart(system: System) -> tuple[System, list[Element]]:
    """Return a system without its guards of θ2, and the guards."""
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
    if any(exact_number(one.outer_stiffness) != 0 for one in barriers):
        raise NotInProofsError(outer=True)
    stiffnesses = [exact_number(one.stiffness) for one in barriers]
    if any(stiffness < 0 for stiffness in stiffnesses):
        raise NotInProofsError(outer=False)
    barrier = BarrierEnergy(float(sum(stiffnesses))) if any(stiffnesses) else None
    soft = soft_energies([one for one in guards if isinstance(one, SoftGuard)])
    stops = [exact_number(one.angle) for one in guards if isinstance(one, Stop)]
    if stops:
        stop = stop_energy(min(stops))
        # A guard that begins beyond the stop, or at it, never acts.
        soft = (*(one for one in soft if one.outer < stop.inner), stop)
    return Guard(barrier, soft) if barrier is not None or soft else None
