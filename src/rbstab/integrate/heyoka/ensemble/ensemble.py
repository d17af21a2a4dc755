"""Integration of many members of one structure: compiled Taylor integration in SIMD batches."""

import numpy as np

from rbstab.integrate.heyoka.compiled_map import lanes_of
from rbstab.integrate.heyoka.ensemble.batches import Batches, Lanes
from rbstab.integrate.heyoka.ensemble.compiled import CHANGE_ROW, CompiledStructure
from rbstab.integrate.heyoka.ensemble.energy_scales import EnergyScales
from rbstab.integrate.heyoka.ensemble.observer import EnsembleObserver
from rbstab.integrate.heyoka.ensemble.trajectories import EnsembleTrajectories
from rbstab.integrate.in_quaternions import LONGEST_TURN
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import THETA
from rbstab.systems.coordinates import QuaternionCoordinates
from rbstab.systems.system import System


class Ensemble:
    """The compiled equations of a structure, integrated for many members.

    Args:
        system: Any system of the structure.
        tolerance: heyoka's tolerance.
        times: The samples, shape (n,), s.
        varies: Which parameters differ between members; see `CompiledStructure`.
        quaternion: Whether a quaternion is integrated in place of Θ. All samples have Θ.

    Attributes:
        times: The samples, shape (n,), s.
        compiled: The compiled structure.
        scales: The energy scales of members.
        batches: Integrates the members.
        observer: Observes their trajectories.
    """

    def __init__(
        self,
        system: System,
        tolerance: float,
        times: Array,
        varies: Array | None = None,
        *,
        quaternion: bool = False,
    ) -> None:
        self.times = times
        self.compiled = CompiledStructure(system, tolerance, varies, quaternion=quaternion)
        self.scales = EnergyScales(self.compiled)
        self.batches = Batches(self.compiled, times)
        self.observer = EnsembleObserver(self.compiled)
        self._supplies = system.supplies

    def run(
        self, parameters: Array, starts: Array, *, sampled: bool = True
    ) -> EnsembleTrajectories:
        """Integrate members over the samples.

        Args:
            parameters: Shape (parameters, m).
            starts: The initial states, shape (states, m).
            sampled: Whether the result has all samples, or only the first and the last one.
        """
        size, members, q = self.compiled.size, slice(starts.shape[1]), self.compiled.q
        scales = self.scales.at_start(parameters, starts)
        given = starts if q is None else q.from_angles(starts)
        found = self.batches.run(parameters, given, scales, sampled=sampled)
        if self._supplies:
            scales = self._repeat_misfits(found, parameters, starts, given, scales)
        lanes = found.states
        change = lanes[CHANGE_ROW, members] * scales[:, np.newaxis]
        supplied = None
        if self._supplies:
            supplied = lanes[size, members] * scales[:, np.newaxis]
        steps, done = found.steps[members], found.done[members]
        trajectories = EnsembleTrajectories(
            lanes[:size], change, steps, done, found.ends[members], scales, supplied
        )
        if q is None:
            return trajectories
        times = self.times if sampled else self.times[[0, -1]]
        return _with_angles(q, trajectories, starts[THETA], times)

    def _repeat_misfits(
        self, found: Lanes, parameters: Array, starts: Array, given: Array, scales: Array
    ) -> Array:
        """Integrate members again whose scale does not fit to what was supplied.

        Their lanes change in place.

        Returns:
            The scales of all members, shape (m,), J.
        """
        members = slice(len(scales))
        audited = found.states[[self.compiled.size, CHANGE_ROW], members]
        audits = np.abs(audited).max(axis=(0, 2))
        fitting = self.scales.fitting(parameters, starts, scales, audits)
        rows = np.flatnonzero((fitting != scales) & found.done[members])
        if not len(rows):
            return scales
        scales[rows] = fitting[rows]
        repeated = self.batches.run(
            parameters[:, rows],
            given[:, rows],
            scales[rows],
            sampled=found.grid is self.batches.grid,
            reuse=False,
        )
        found.states[:, rows] = repeated.states[:, : len(rows)]
        found.steps[rows], found.done[rows] = (
            part[: len(rows)] for part in (repeated.steps, repeated.done)
        )
        for row, ends in zip(rows.tolist(), repeated.ends, strict=False):
            found.ends[row] = ends
        return scales


def _with_angles(
    q: QuaternionCoordinates, found: EnsembleTrajectories, start: Array, times: Array
) -> EnsembleTrajectories:
    """Return trajectories of quaternions with Θ.

    A member whose steps do not tell how it turns past θ2 = ±90° is not done.

    Args:
        q: The coordinates.
        found: The trajectories.
        start: Θ at their start, shape (3, m), rad.
        times: Their samples, shape (n,), s.
    """
    size, members, done = q.angles.size, len(found.steps), found.done.copy()
    full = lanes_of(members)
    lanes = np.delete(found.lanes, size, axis=0)
    angles = []
    for k in range(members):
        ends = found.ends[k]
        y, t = ends[1 : 1 + len(found.lanes)], ends[0]
        Theta, turn = q.angles_along(found.lanes[:, k], times, start[:, k], y, t)
        lanes[THETA, k] = Theta[:, : len(times)]
        angles.append(Theta[:, len(times) :])
        done[k] &= turn <= LONGEST_TURN
    lanes[THETA, members:] = lanes[THETA, full[members:]]
    return found._replace(lanes=lanes, done=done, angles=angles)
