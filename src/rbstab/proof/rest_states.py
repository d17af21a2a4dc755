"""All rest states of a system in a range of Θ, and whether there is exactly one."""

from dataclasses import dataclass

import numpy as np

from rbstab.analysis.configuration import Configurations, configurations
from rbstab.analysis.proof import boxes as rows
from rbstab.analysis.proof.outcome import SearchOutcome
from rbstab.analysis.proof.rest_point import RestPoint
from rbstab.analysis.rest_state import held_at_kink, rest_state_at
from rbstab.mechanics.numbers import Array
from rbstab.proof.bounds import BoundedEnergy
from rbstab.proof.confine import confined
from rbstab.proof.held import held_zeros, jumps, zeros_at_stop
from rbstab.proof.model import Energy, ExactSystem, energy_of, value_at
from rbstab.proof.regions import Regions, regions_of
from rbstab.proof.search import Box, Search, Zero, Zeros, joined, newton
from rbstab.systems.system import System

PITCH_END = np.nextafter(np.pi / 2, 4.0)
"""A double beyond π/2."""

TURN_END = np.nextafter(np.pi, 4.0)
"""A double beyond π."""

WIDE_LIMIT = 16_000
"""The number of boxes at which a proof for all real θ1 and θ3 stops."""

STARTS = 256
"""Random starts of a search without a proof."""

SAME = 3e-4
"""rad: results of Newton's method that are closer count as one."""

MOST_CENTRES = 64
"""Undecided boxes from whose centres states on a surface are looked for."""


@dataclass(frozen=True, eq=False)
class RestStates:
    """The rest states of a system in a range, from the lowest energy to the highest.

    Args:
        energy: The potential energy.
        states: The rest states.
        zeros: The same as zeros of the gradient, in the same order, with the undecided boxes.
        examined: The number of boxes that the proof examined.
        outcome: How it ended.
        end: The largest |Θ| in the range, shape (3,), rad.
        covered: The share of the range that is decided.
    """

    energy: Energy
    states: tuple[RestPoint, ...]
    zeros: Zeros
    examined: int
    outcome: SearchOutcome
    end: Array
    covered: float = 1.0

    @property
    def undecided(self) -> rows.Boxes:
        """Boxes of Θ that may contain further rest states."""
        return rows.Boxes(self.zeros.undecided.lo.T, self.zeros.undecided.hi.T)

    @property
    def regions(self) -> Regions:
        """The region of the lowest rest state, and that of each minimum."""
        return regions_of(self.energy, self.zeros, Box(-self.end, self.end))

    @property
    def proved(self) -> bool:
        """Whether these are proved to be all rest states in the range."""
        return self.outcome is SearchOutcome.PROVED

    @property
    def unique(self) -> bool | None:
        """Whether the range has exactly one rest state; None if neither answer is proved."""
        if sum(point.proved for point in self.states) > 1:
            return False
        return len(self.states) == 1 if self.proved else None

    @property
    def every_start(self) -> bool:
        """Whether all motions from |θ2| < π/2 converge to the only rest state (theorem 10).

        To be asked of the rest states for all real θ1 and θ3: a barrier or a stop keeps all motions
        away from θ2 = ±π/2, and the energy grows with |θ1| and |θ3| (`confine`). With barriers on
        θ1 and θ3, of those in the range of eq. 5: then it is of motions that start there.
        """
        only = self.states[0] if self.proved and self.unique else None
        is_minimum = only is not None and only.index_proved and only.index == 0
        return is_minimum and 1 in self.energy.closed

    @property
    def closed(self) -> bool:
        """Whether all motions from the range of eq. 5 converge to the one rest state.

        It needs barriers on θ1 and θ3 too, which keep these motions in the range.
        """
        return self.every_start and {0, 2} <= self.energy.closed


class Body:
    """A system with its exact potential energy, of which rest states are proved.

    Args:
        system: The system, in doubles.
        exact_system: Builds the same in exact numbers, without elements of users.

    Raises:
        NoMinimumError: As `energy_of`.
        TypeError: As `energy_of`.
    """

    def __init__(self, system: System, exact_system: ExactSystem) -> None:
        self.energy = energy_of(system, exact_system)
        self.at_rest: Configurations = configurations(system)
        self.bounded = BoundedEnergy(
            self.energy.U, free=self.energy.free, least=self.energy.least
        )

    @property
    def range(self) -> Array:
        """The largest |Θ| in the range of eq. 5, up to a stop, shape (3,), rad."""
        stop = self.energy.stop
        pitch = PITCH_END if stop is None else min(PITCH_END, np.nextafter(float(stop), 4.0))
        return np.array([TURN_END, pitch, TURN_END])

    def proved(self, end: Array, limit: int) -> RestStates:
        """Prove the rest states with -end <= Θ <= end, with at most so many boxes."""
        box = Box(-end, end)
        held = held_zeros(self.energy, box)
        found = Search(self.bounded, box, known=held).run(limit)
        if found.undecided.count and not found.family and jumps(self.energy):
            found = self._once_more(box, held, found, limit)
        faces = zeros_at_stop(self.energy, box)
        return self._rest_states(found, faces, end, stopped=found.examined >= limit)

    def _once_more(self, box: Box, held: list[Zero], found: Zeros, limit: int) -> Zeros:
        """Search again, if there are further states on a surface near undecided boxes."""
        left = found.undecided[slice(MOST_CENTRES)]
        more = held_zeros(self.energy, box, 0.5 * (left.lo + left.hi))
        new = [
            zero for zero in more if not any(one.domain.contains(zero.point) for one in held)
        ]
        return Search(self.bounded, box, known=[*held, *new]).run(limit) if new else found

    def _rest_states(
        self, found: Zeros, faces: list[Zeros], end: Array, *, stopped: bool
    ) -> RestStates:
        undecided = joined([found.undecided, *(face.undecided for face in faces)], 3)
        outcome = SearchOutcome.UNDECIDED if undecided.count else SearchOutcome.PROVED
        if undecided.count and (found.family or stopped):
            outcome = SearchOutcome.FAMILY if found.family else SearchOutcome.BOX_LIMIT
        zeros = [*found.zeros, *(zero for face in faces for zero in face.zeros)]
        zeros.sort(key=lambda zero: zero.energy)
        examined = found.examined + sum(face.examined for face in faces)
        whole = Zeros(tuple(zeros), undecided, examined, found.family, found.share)
        points = [self._point(zero, proved=True) for zero in zeros]
        if outcome in {SearchOutcome.UNDECIDED, SearchOutcome.BOX_LIMIT}:
            # If all zeros are known, a point that could not be isolated is none.
            unproved = (_unproved(x, self.bounded) for x in found.singular)
            points += [self._point(zero, proved=False) for zero in unproved]
        return RestStates(self.energy, tuple(points), whole, examined, outcome, end, found.share)

    def wide(self, rest: RestStates, limit: int) -> RestStates | None:
        """Prove the rest states with |θ2| < π/2 and any θ1 and θ3.

        Returns:
            Those in a box beyond which there are none: `rest` itself if its box is this one. None
            if no such box is known.
        """
        bounds = confined(self.energy, float(rest.end[1]))
        if bounds is None:
            return None
        end = np.array([bounds[0], rest.end[1], bounds[1]])
        return rest if np.array_equal(end, rest.end) else self.proved(end, limit)

    def searched(self, seed: int = 0) -> RestStates:
        """Return the rest states in the range that Newton's method reaches; nothing is proved."""
        end = self.range
        starts = np.random.default_rng(seed).uniform(-1, 1, (3, STARTS)) * end[:, None]
        points, last = newton(self.bounded, np.concatenate([np.zeros((3, 1)), starts], 1))
        inside = np.all(np.abs(points) < end[:, None], axis=0) & (last < 1e-9)
        box, different = Box(-end, end), list[Array]()
        for x in points[:, inside].T:
            if all(np.abs(x - other).max() > SAME for other in different):
                different.append(x)
        zeros = [_unproved(x, self.bounded) for x in different]
        zeros += held_zeros(self.energy, box)
        zeros += [zero for face in zeros_at_stop(self.energy, box) for zero in face.zeros]
        zeros.sort(key=lambda zero: zero.energy)
        points = tuple(self._point(zero, proved=False) for zero in zeros)
        nothing = Zeros(tuple(zeros), joined([], 3), 0)
        return RestStates(self.energy, points, nothing, 0, SearchOutcome.SEARCHED, end)

    # -- points ----------------------------------------------------------------------------------

    def configuration(self, Theta: Array) -> Array:
        """Return q = [Θ, X, own states] with the least energy at Θ, to round-off."""
        q = np.zeros(self.at_rest.size)
        q[:3] = Theta
        if self.energy.free:
            z = self.bounded.minimiser(Theta[:, None]).z[:, 0]
            for k, value in zip(self.energy.free, z, strict=True):
                shift = self.energy.shift.get(k)
                q[k] = value + (0.0 if shift is None else value_at(shift, q))
        for k, place in self.energy.minimiser.items():
            q[k] = value_at(place, q)
        return q

    def _point(self, zero: Zero, *, proved: bool) -> RestPoint:
        state = rest_state_at(self.at_rest, self.configuration(zero.point))
        if zero.normal is not None:
            state = held_at_kink(self.at_rest, state, zero.normal)
        index, degenerate = zero.index, False
        if index is None:
            values = np.linalg.eigvalsh(self.bounded.at(zero.point[:, None])[2][:, :, 0])
            index = int(np.sum(values < 0))
            degenerate = bool(np.abs(values).min() <= 1e-6 * np.abs(values).max())
        return RestPoint(
            state,
            index,
            rows.Boxes(zero.enclosure.lo[None], zero.enclosure.hi[None]),
            proved,
            proved and zero.index is not None,
            zero.ridge,
            degenerate,
        )


def _unproved(x: Array, energy: BoundedEnergy) -> Zero:
    return Zero(x, Box(x, x), Box(x, x), None, float(energy.at(x[:, None])[0][0]))
