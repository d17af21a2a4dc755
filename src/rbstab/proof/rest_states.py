"""All rest states of a system in a range of Θ, and whether there is exactly one."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from rbstab.analysis.configuration import Configurations, configurations
from rbstab.analysis.rest_state import held_at_kink, rest_state_at
from rbstab.elements.spring import Spring
from rbstab.mechanics.numbers import Array
from rbstab.proof.boxes import Box, as_boxes, joined
from rbstab.proof.confine import confined, end_of_pitch
from rbstab.proof.enclosures.bounds import BoundedEnergy, times
from rbstab.proof.enclosures.levels import Ranges, least_values
from rbstab.proof.enclosures.tied import TiedBounds, bounds_of
from rbstab.proof.entries import ProvedState
from rbstab.proof.exact.atoms import COS, SIN, VAR
from rbstab.proof.model import RANGE_END, Energy, ExactSystem, NoMinimumError, energy_of
from rbstab.proof.passive.passive import first_jump
from rbstab.proof.pieces import rest_zeros
from rbstab.proof.reasons import NoEnergyReason, NoReducedEnergy, reject
from rbstab.proof.regions.regions import Regions, regions_of
from rbstab.proof.rest_points import RestStates, SearchOutcome, state_entry
from rbstab.proof.search import SINGULAR, Zeros
from rbstab.proof.zeros import Zero
from rbstab.systems.system import System

LENGTH_LIMIT = 4_000
"""Boxes that are searched for the least length of a line."""

ASTRAY = 1e-3
"""m: a longer step at the end of the search for the lowest z at one Θ shows that it found none."""

MAX_END = 20.0
"""rad: wider boxes of θ1 and θ3 are not searched, because they take too long."""

WIDE_LIMIT = 16_000
"""Boxes of a search for all real θ1 and θ3. A soft body may have hundreds of rest states."""

WIDE_LIMIT_WITH_FUNCTIONS = 100_000
"""The same for an energy with lengths, or other functions of Θ, whose boxes are smaller."""

KINKED = (
    "its force jumps, and no proof takes such a force into account where X or own states are free"
)


def reduced_energy(system: System, exact_system: ExactSystem) -> Energy:
    """Return the potential energy of a system that proofs are about, least over X and own states.

    Args:
        system: The system, in doubles.
        exact_system: Builds the same in exact numbers, without elements of users.

    Raises:
        NoReducedEnergy: It has none; the error gives the reason.
    """
    reject(system)
    try:
        return energy_of(system, exact_system)
    except NoMinimumError as error:
        raise NoReducedEnergy(NoEnergyReason.NOT_HELD) from error
    except OverflowError as error:
        raise NoReducedEnergy(NoEnergyReason.NOT_FINITE) from error
    except (TypeError, AttributeError, ValueError, ArithmeticError) as error:
        raise NoReducedEnergy(NoEnergyReason.NOT_IN_PROOFS, str(error)) from error


class Body:
    """A system with its exact potential energy, of which rest states are proved.

    Args:
        system: The system, in doubles.
        exact_system: Builds the same in exact numbers, without elements of users.

    Raises:
        NoReducedEnergy: The system has no reduced potential energy; the error gives the reason.
    """

    def __init__(self, system: System, exact_system: ExactSystem) -> None:
        self.energy = reduced_energy(system, exact_system)
        try:
            self.bounded = bounds_of(self.energy)
        except ValueError as error:
            raise NoReducedEnergy(NoEnergyReason.NOT_IN_PROOFS, str(error)) from error
        self.at_rest: Configurations = configurations(system)
        if self.energy.free:
            self._reject_beside_springs()
            self._reject_unbalanced()
        if any(isinstance(element, Spring) for element in system.elements):
            self._reject_lengths()

    def _reject_beside_springs(self) -> None:
        """Raise `NoReducedEnergy` for what needs an energy that is convex in X, if it is not."""
        # On the faces of a stop the energy is taken to be convex in X, which springs are not.
        if isinstance(self.bounded, TiedBounds) and self.energy.stop is not None:
            raise NoReducedEnergy(NoEnergyReason.STOP_BESIDE_SPRINGS)
        # A force that jumps may hold the body, where X or own states are free.
        for element in self.at_rest.system.elements:
            if element.from_user and element.mode_count and first_jump(self.at_rest, element) == 1:
                why = f"{element.name}: {KINKED}"
                raise NoReducedEnergy(NoEnergyReason.NOT_IN_PROOFS, why)

    def _reject_unbalanced(self) -> None:
        """Raise `NoReducedEnergy` if z runs away at Θ = 0, as where a motor is too weak."""
        upright = np.zeros((3, 1))
        least = self.bounded.minimiser(upright)
        _, slopes, _ = self.bounded.at_all(upright, least.z)
        step = times(least.inverse, slopes[self.bounded.z])
        if np.abs(step).max() > ASTRAY:
            raise NoReducedEnergy(NoEnergyReason.NOT_BALANCED)

    def _reject_lengths(self) -> None:
        """Raise `NoReducedEnergy` if a line may have no length at some attitude of a held body."""
        end = self.within_stop(RANGE_END)
        roots = [] if self.energy.free else [a for a in self.energy.U.all_atoms if a.kind == "sqrt"]
        for root in roots:
            square = Ranges(BoundedEnergy(root.inner, least=self.energy.least))
            shortest = least_values(square, as_boxes(Box(-end, end)), LENGTH_LIMIT)
            if not shortest.bound[0] > 0:
                raise NoReducedEnergy(NoEnergyReason.NO_LENGTH)

    def proved(
        self, limit: int, end: Array = RANGE_END, proved_zeros: Sequence[Zero] = ()
    ) -> RestStates:
        """Prove the rest states with -end <= Θ <= end, with at most so many boxes.

        Args:
            limit: The number of boxes at which the search stops.
            end: The largest |Θ|, shape (3,), rad; by default that of eq. 5.
            proved_zeros: Zeros that are proved already, and keep their enclosures.
        """
        end = self.within_stop(end)
        zeros = rest_zeros(self.energy, self.bounded, Box(-end, end), limit)
        zeros = replace(zeros, zeros=tuple(_as_proved(zero, proved_zeros) for zero in zeros.zeros))
        outcome = SearchOutcome.UNDECIDED if zeros.undecided.count else SearchOutcome.PROVED
        if zeros.undecided.count and (zeros.family or zeros.stopped):
            outcome = SearchOutcome.FAMILY if zeros.family else SearchOutcome.BOX_LIMIT
        # If all zeros are known, a point that could not be isolated is none.
        unknown = outcome in {SearchOutcome.UNDECIDED, SearchOutcome.BOX_LIMIT}
        return self._rest_states(zeros, end, outcome, zeros.singular if unknown else ())

    def searched(self, seed: int = 0) -> RestStates:
        """Return the rest states in the range that Newton's method reaches; nothing is proved."""
        end = self.within_stop(RANGE_END)
        zeros = rest_zeros(self.energy, self.bounded, Box(-end, end), 0, seed=seed)
        outcome = SearchOutcome.FAMILY if zeros.family else SearchOutcome.SEARCHED
        singular = () if zeros.family else zeros.singular
        points = self._rest_states(zeros, end, outcome, singular, proved=False)
        # Without an index, no minimum has a region.
        unknown = tuple(replace(zero, index=None) for zero in zeros.zeros)
        return replace(points, zeros=Zeros(unknown, joined([], 3), 0))

    def _rest_states(
        self,
        zeros: Zeros,
        end: Array,
        outcome: SearchOutcome,
        singular: Sequence[Array],
        *,
        proved: bool = True,
    ) -> RestStates:
        points = [self._point(zero, proved=proved) for zero in zeros.zeros]
        for x in singular:
            value = float(self.bounded.at(x[:, None])[0][0])
            zero = Zero(x, Box(x, x), Box(x, x), None, value)
            points.append(self._point(zero, proved=False))
        # A spring may lose its length on the way to an end.
        closed = frozenset() if isinstance(self.bounded, TiedBounds) else self.energy.closed
        return RestStates(tuple(points), zeros, outcome, end, closed)

    def regions(self, rest: RestStates, *, confining: bool = False) -> Regions:
        """Return c* of a range, and the region of each minimum: theorems 3 and 5.

        Args:
            rest: What `proved` or `wide` returned.
            confining: Whether it is what `wide` returned.
        """
        box = Box(-rest.end, rest.end)
        return regions_of(self.energy, rest.zeros, box, self.bounded, confining=confining)

    def wide(self, rest: RestStates, limit: int | None = None) -> RestStates | None:
        """Prove the rest states with |θ2| < π/2 and any θ1 and θ3.

        Args:
            rest: The rest states in the range of eq. 5.
            limit: The number of boxes at which the proof stops, if it is less than by default.

        Returns:
            Those in a box beyond which there are none: `rest` itself if its box is this one. None
            if no such box is known, or if a barrier closes the range of θ1 and θ3.
        """
        outer = confined(self.energy, self.bounded)
        if outer is None or not np.all(outer < MAX_END):
            return None
        end = self.within_stop(np.array([outer[0], RANGE_END[1], outer[1]]))
        if np.array_equal(end, rest.end):
            return rest
        most = self.wide_limit if limit is None else min(self.wide_limit, limit)
        return self.proved(most, end, rest.zeros.zeros)

    @property
    def wide_limit(self) -> int:
        """The number of boxes at which a search for all real θ1 and θ3 stops."""
        plain = all(a.kind in {VAR, SIN, COS} or a.variables <= {1} for a in self.energy.U.atoms)
        return WIDE_LIMIT if plain else WIDE_LIMIT_WITH_FUNCTIONS

    def within_stop(self, end: Array) -> Array:
        """Return the largest |Θ| in a range that a motion can reach with a stop, shape (3,)."""
        return np.array([end[0], min(end[1], end_of_pitch(self.energy)), end[2]])

    # -- points ----------------------------------------------------------------------------------

    def configuration(self, Theta: Array) -> Array:
        """Return q = [Θ, X, own states] with the least energy at Θ, to round-off."""
        q = np.zeros(self.at_rest.size)
        q[:3] = Theta
        q[list(self.energy.free)] = self.bounded.minimiser(Theta[:, None]).z[:, 0]
        return self.energy.completed(q)

    def _point(self, zero: Zero, *, proved: bool) -> ProvedState:
        state = rest_state_at(self.at_rest, self.configuration(zero.point))
        if zero.normal is not None:
            state = held_at_kink(self.at_rest, state, zero.normal)
        more: dict[str, Any] = {"ridge": zero.ridge or None}
        if proved:
            index_proved = zero.index is not None
            more |= {"proved": True, "enclosure": zero.enclosure, "index_proved": index_proved}
        if zero.index is not None:
            return state_entry(state, zero.index, **more)
        index = int(np.sum(self.bounded.curvatures(zero.point) < 0))
        singular = _is_singular(self.bounded, zero.point)
        return state_entry(state, index, **more, degenerate=singular or None)


def _as_proved(zero: Zero, proved_zeros: Sequence[Zero]) -> Zero:
    """Return the proved zero that a zero is: that in whose domain, which has no other, it lies."""
    at = as_boxes(zero.enclosure)
    return next((proved for proved in proved_zeros if at.within(proved.domain)[0]), zero)


def _is_singular(energy: BoundedEnergy, x: Array) -> bool:
    values = np.abs(energy.curvatures(x))
    return bool(values.min() <= SINGULAR * values.max())
