"""Integration of many members of one structure: compiled Taylor integration in SIMD batches."""

import numpy as np

from rbstab.integrate.heyoka.ensemble.batches import Batches, Lanes
from rbstab.integrate.heyoka.ensemble.compiled import CHANGE_ROW, CompiledStructure
from rbstab.integrate.heyoka.ensemble.energy_scales import EnergyScales
from rbstab.integrate.heyoka.ensemble.observer import EnsembleObserver
from rbstab.integrate.heyoka.ensemble.trajectories import EnsembleTrajectories
from rbstab.mechanics.numbers import Array
from rbstab.systems.system import System


class Ensemble:
    """The compiled equations of a structure, integrated for many members.

    Args:
        system: Any system of the structure.
        tolerance: heyoka's tolerance.
        times: The samples, shape (n,), s.
        varies: Which parameters differ between members; see `CompiledStructure`.
        parts: The parts of the first interval between samples; see `EnsembleTrajectories.first`.

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
        parts: int = 1,
    ) -> None:
        self.times = times
        self.compiled = CompiledStructure(system, tolerance, varies)
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
        size, members = self.compiled.size, slice(starts.shape[1])
        begin = np.zeros(starts.shape[1]) if begin is None else begin
        scales = self.scales.at_start(parameters, starts)
        found = self.batches.run(parameters, starts, scales, times, begin)
        if self._supplies:
            scales = self._repeat_misfits(found, parameters, starts, scales, times, begin)
        lanes = found.states
        change = lanes[CHANGE_ROW, members] * scales[:, np.newaxis]
        supplied, first = None, None
        if self._supplies:
            supplied = lanes[size, members] * scales[:, np.newaxis]
        if times is None and self.batches.parts > 1:
            first = found.first[:size]
        steps, done = found.steps[members], found.done[members]
        return EnsembleTrajectories(
            lanes[:size], change, steps, done, first=first, supplied_energy=supplied
        )

    def _repeat_misfits(  # noqa: PLR0913, PLR0917 (all that a run depends on)
        self,
        found: Lanes,
        parameters: Array,
        starts: Array,
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
            starts[:, rows],
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
