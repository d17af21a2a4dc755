"""The members that start where convergence to a rest state is proved, many at once."""

from collections.abc import Mapping
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from rbstab.analysis.bounded import SLACK, Bounded, bounded_decimal, bounded_decimals
from rbstab.config.build import start_motion, system_of
from rbstab.config.numbers import replaced
from rbstab.config.schema import Config
from rbstab.config.user_code.permission import has_code
from rbstab.experiment.convergence.enclosed_system import enclosed_system
from rbstab.experiment.stored_proof.proof import Proof
from rbstab.experiment.stored_proof.starts import reached_states
from rbstab.mechanics.motion import Motion
from rbstab.mechanics.numbers import Array
from rbstab.sweep.plan.axes import VariedKey, varied_numbers
from rbstab.systems.modes import guards_at, has_modes, with_modes
from rbstab.systems.system import System

BATCH_SIZE = 16384
"""Members whose energies are bounded at once: with fewer, calls of numpy take a third of the time;
with many more, the arrays do not fit into a cache."""


class Starts(NamedTuple):
    """Bounds on the starts of m members.

    Attributes:
        energy: Upper bounds of the total energy, shape (m,), J.
        low: The lower corner of the box of Θ, shape (m, 3), rad.
        high: The upper corner.
    """

    energy: Array
    low: Array
    high: Array


class ProvedStarts:
    """The starts from which convergence is proved, of members that differ in their initial state.

    Args:
        base: The base of the members.
        varied_keys: The varied keys, all of them keys of the initial state.
        proof: The proof of the rest states of the base.
    """

    def __init__(self, base: Config, varied_keys: tuple[VariedKey, ...], proof: Proof) -> None:
        self.base = base
        self.varied_keys = varied_keys
        self.proof = proof

    @cached_property
    def system(self) -> System:
        """The system of the base, of bounded numbers."""
        with np.errstate(all="ignore"):
            return system_of(self.base, bounded_decimals)

    def find(self, values: Mapping[str, Array], members: int) -> Array:
        """Return the number of the rest state to which each member is proved to converge.

        Args:
            values: The values of the members from `Plan.values`, each of shape (members,).
            members: The number of members.

        Returns:
            The numbers, from 1 for the lowest; 0 where nothing is proved; shape (members,).
        """
        numbers = np.zeros(members, dtype=np.int32)
        for first in range(0, members, BATCH_SIZE):
            batch = slice(first, min(first + BATCH_SIZE, members))
            some = {varied.key: values[varied.key][batch] for varied in self.varied_keys}
            try:
                starts = self.starts(some, batch.stop - first)
            except (TypeError, AttributeError):
                if not has_code(self.base):
                    raise
                # Code of a user may not accept bounded numbers; then nothing is proved.
                return numbers
            numbers[batch], _ = reached_states(self.proof, *starts)
        return numbers

    def starts(self, values: Mapping[str, Array], members: int) -> Starts:
        """Return bounds on the starts of members, around the exact decimals of their configs.

        Args:
            values: The values of the members, each of shape (members,).
            members: The number of members.
        """
        with np.errstate(all="ignore"):
            motion, own_states = bounded_start(self.base, self.varied_keys, values, self.system)
            state = self.system.start(motion, own_states)
            kinetic = self.system.body.kinetic_energy(motion.Omega, motion.V)
            system, unclear = _in_modes(self.system, state)
            energy = as_bounded(kinetic) + system.stored_energy(motion, state)
            angles = [as_bounded(angle) for angle in motion.Theta]

        low, high = (
            [column_of(getattr(a, side), members) for a in angles] for side in ("low", "high")
        )
        most = np.where(unclear, np.inf, energy.high)
        return Starts(column_of(most, members), np.stack(low, axis=1), np.stack(high, axis=1))

    def states(self, values: Mapping[str, Array], members: int) -> tuple[Array, Array]:
        """Return the initial states of members as they are enclosed, and bounds on their errors.

        Args:
            values: As for `starts`.
            members: The number of members.

        Returns:
            The states of `enclosed_system`, shape (members, n), and the bounds in the same shape.
        """
        with np.errstate(all="ignore"):
            system = enclosed_system(self.base, bounded_decimals)
            state = system.start(*bounded_start(self.base, self.varied_keys, values, system))
        bounded = [as_bounded(entry) for entry in state]
        centre = np.stack([column_of(entry.value, members) for entry in bounded], axis=1)
        error = np.stack([column_of(SLACK * entry.error, members) for entry in bounded], axis=1)
        return centre, error


def bounded_start(
    base: Config, varied_keys: tuple[VariedKey, ...], values: Mapping[str, Array], system: System
) -> tuple[Motion, Array]:
    """Return the motion and the own states at the start of members, with bounds.

    Args:
        base: The base config.
        varied_keys: The keys whose values differ between the members.
        values: The values of the members at each key.
        system: The system of the members.
    """
    floats = {varied.key: values[varied.key].astype(float) for varied in varied_keys}
    varied_values = varied_numbers(base, varied_keys, floats)
    config = replaced(base, {path: bounded_decimal(value) for path, value in varied_values.items()})
    return start_motion(config, system, bounded_decimals)


def column_of(entry: Any, members: int) -> Array:
    """Return a number of all members as an array, shape (members,)."""
    return np.broadcast_to(np.asarray(entry, dtype=float), (members,))


def _in_modes(system: System, state: Array) -> tuple[System, Array]:
    """Return a system in the modes of each member at the start, and where they are not known."""
    if not has_modes(system):
        return system, np.array(False)
    guards = [as_bounded(guard) for guard in guards_at(system, state)]
    # The formulas of elements use modes as numbers, so each member has its own.
    modes: list[Any] = [Bounded(np.where(np.greater(g.value, 0), 1.0, 0.0), 0.0) for g in guards]
    unclear = np.array(False)
    for guard in guards:
        unclear = unclear | ~((guard.low > 0) | (guard.high < 0))
    return with_modes(system, tuple(modes)), unclear


def as_bounded(number: Any) -> Bounded:
    """Return a number that may be a float, which is exact."""
    return number if isinstance(number, Bounded) else Bounded(float(number), 0.0)
