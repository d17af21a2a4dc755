"""Integration of many members of one structure: compiled Taylor integration in SIMD batches."""

from collections.abc import Callable

import numpy as np

from rbstab.integrate.heyoka.compiled_map import SIMD, lanes_of
from rbstab.integrate.heyoka.ensemble.batches import Batches, Lanes
from rbstab.integrate.heyoka.ensemble.compiled import CHANGE_ROW, CompiledStructure
from rbstab.integrate.heyoka.ensemble.energy_scales import EnergyScales
from rbstab.integrate.heyoka.ensemble.observer import EnsembleObserver
from rbstab.integrate.heyoka.ensemble.trajectories import EnsembleTrajectories
from rbstab.integrate.in_quaternions import parts_needed, refined
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.quaternion import same_turns
from rbstab.mechanics.states import THETA
from rbstab.systems.coordinates import QuaternionCoordinates
from rbstab.systems.system import System

MAX_FINE_SAMPLES = 1024 * 201
"""The most samples that are in memory at once of motions that are sampled finer."""


class Ensemble:
    """The compiled equations of a structure, integrated for many members.

    Args:
        system: Any system of the structure.
        tolerance: heyoka's tolerance.
        times: The samples, shape (n,), s.
        varies: Which parameters differ between members; see `CompiledStructure`.
        parts: The parts of the first interval between samples; see `EnsembleTrajectories.first`.
        quaternion: Whether a quaternion is integrated in place of Θ. All states have Θ.

    Attributes:
        times: The samples, shape (n,), s.
        compiled: The compiled structure.
        scales: The energy scales of members.
        batches: Integrates the members.
        observer: Observes their trajectories.
    """

    def __init__(  # noqa: PLR0913 (what is compiled, and how it is sampled)
        self,
        system: System,
        tolerance: float,
        times: Array,
        varies: Array | None = None,
        parts: int = 1,
        *,
        quaternion: bool = False,
    ) -> None:
        self.times = times
        self.compiled = CompiledStructure(system, tolerance, varies, quaternion=quaternion)
        self.scales = EnergyScales(self.compiled)
        self.batches = Batches(self.compiled, times, parts)
        self.observer = EnsembleObserver(self.compiled)
        self._supplies = system.supplies

    def run(
        self,
        parameters: Array,
        starts: Array,
        times: Array | None = None,
        begin: Array | None = None,
    ) -> EnsembleTrajectories:
        """Integrate members over the samples.

        Args:
            parameters: Shape (parameters, m).
            starts: The initial states, shape (states, m).
            times: Other samples, shape (n,), s. Trajectories at other samples stay valid. More
                samples between the same ends do not change a trajectory.
            begin: The time of the start of each member, shape (m,), s, which is added to the
                samples; default 0.
        """
        size, members, q = self.compiled.size, slice(starts.shape[1]), self.compiled.q
        begin = np.zeros(starts.shape[1]) if begin is None else begin
        scales = self.scales.at_start(parameters, starts)
        given = starts if q is None else q.from_angles(starts)
        found = self.batches.run(parameters, given, scales, times, begin)
        if self._supplies:
            scales = self._repeat_misfits(found, parameters, starts, given, scales, times, begin)
        lanes = found.states
        change = lanes[CHANGE_ROW, members] * scales[:, np.newaxis]
        supplied, first = None, None
        if self._supplies:
            supplied = lanes[size, members] * scales[:, np.newaxis]
        if times is None and self.batches.parts > 1:
            first = found.first[:size]
        steps, done = found.steps[members], found.done[members]
        trajectories = EnsembleTrajectories(
            lanes[:size], change, steps, done, first=first, supplied_energy=supplied
        )
        if q is None:
            return trajectories

        def finer(rows: Array, fine: Array) -> Array:
            return self.run(parameters[:, rows], starts[:, rows], fine, begin[rows]).states[THETA]

        sampled = self.times if times is None else times
        return _with_angles(q, trajectories, starts[THETA], sampled, finer)

    def _repeat_misfits(  # noqa: PLR0913, PLR0917 (all that a run depends on)
        self,
        found: Lanes,
        parameters: Array,
        starts: Array,
        given: Array,
        scales: Array,
        times: Array | None,
        begin: Array,
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
            times,
            begin[rows],
            reuse=False,
        )
        for name in ("states", "first", "steps", "done"):
            target, source = getattr(found, name), getattr(repeated, name)
            if name in {"states", "first"}:
                target[:, rows] = source[:, : len(rows)]
            else:
                target[rows] = source[: len(rows)]
        return scales


def _with_angles(
    q: QuaternionCoordinates,
    found: EnsembleTrajectories,
    start: Array,
    times: Array,
    finer: Callable[[Array, Array], Array],
) -> EnsembleTrajectories:
    """Return trajectories of quaternions with Θ.

    Args:
        q: The coordinates.
        found: The trajectories.
        start: Θ at their start, shape (3, m), rad.
        times: Their samples, shape (n,), s.
        finer: Returns Θ of some members at finer samples.
    """
    start = start[:, lanes_of(start.shape[1])]
    lanes, turns = q.to_angles(found.lanes, times, start)
    parts = parts_needed(turns[: len(found.steps)], found.steps, len(times), 1)
    parts[~found.done] = 1.0
    for needed in np.unique(parts[parts > 1.0]).astype(int).tolist():
        rows, fine = np.flatnonzero(parts == needed), refined(times, needed)
        size = max(SIMD, MAX_FINE_SAMPLES // len(fine) // SIMD * SIMD)
        for chosen in np.split(rows, range(size, len(rows), size)):
            known = finer(chosen, fine)[..., ::needed]
            lanes[THETA, chosen] = same_turns(lanes[THETA, chosen], known)
    first = found.first
    if first is not None:
        first, _ = q.to_angles(first, refined(times[:2], first.shape[2] - 1), start)
    return found._replace(lanes=lanes, first=first)
