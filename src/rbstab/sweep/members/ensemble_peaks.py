"""The peaks of members that are integrated in batches.

A member is integrated again from a sample over one interval, to find a turning point that its
samples do not show accurately enough. If there are fewer intervals than steps of the integrator,
the samples may not show all turning points. Then the whole motion is sampled finer.
"""

from typing import NamedTuple

import numpy as np

from rbstab.analysis.peak_search import RELATIVE, Peaks, Samples, find_peaks, peaks_of_cubics
from rbstab.integrate.heyoka.compiled_map import SIMD
from rbstab.integrate.heyoka.ensemble import Ensemble, EnsembleTrajectories, ObservedTrajectories
from rbstab.mechanics.numbers import Array
from rbstab.sweep.members.refinement import MAX_SAMPLES, PARTS, refined, refinements


class EnsemblePeaks(NamedTuple):
    """The search for the peaks of the members of an ensemble.

    Args:
        ensemble: The ensemble.
        tolerance: The tolerance of the integration. Peaks are not searched more accurately.
        samples_in_memory: The most samples that are in memory at once.
    """

    ensemble: Ensemble
    tolerance: float
    samples_in_memory: int

    def find(
        self,
        parameters: Array,
        starts: Array,
        trajectories: EnsembleTrajectories,
        observed: ObservedTrajectories,
    ) -> Peaks:
        """Return the peaks of E and Θ. Those of members that are not done are NaN.

        Args:
            parameters: Shape (parameters, m).
            starts: The initial states, shape (states, m).
            trajectories: The trajectories of the members.
            observed: Their observed quantities.
        """
        times = self.ensemble.times
        length = (times[-1] - times[0]) / (len(times) - 1)
        given = self._samples(times, length, parameters, trajectories.states, observed)
        factors = np.where(
            trajectories.done, refinements(trajectories.steps, len(times), MAX_SAMPLES), 0
        )
        too_fast = trajectories.steps > factors * (len(times) - 1)
        if (factors <= 1).all():
            found = self._peaks(given)
            for target in found:
                target[:, ~trajectories.done] = np.nan
            found.error[:, too_fast] = np.nan
            return found
        found = Peaks(*np.full((3, len(given.values), len(factors)), np.nan))
        for factor in np.unique(factors[factors > 0]).tolist():
            rows = np.flatnonzero(factors == factor)
            fine = refined(times, factor)
            size = max(SIMD, self.samples_in_memory // len(fine) // SIMD * SIMD)
            for first in range(0, len(rows), size):
                chosen = rows[first : first + size]
                samples = self._samples_again(
                    parameters[:, chosen], starts[:, chosen], fine, np.array(0.0)
                )
                cubics = peaks_of_cubics(_of_members(given, chosen))
                for target, part in zip(found, self._peaks(samples, cubics), strict=True):
                    target[:, chosen] = part
        found.error[:, too_fast] = np.nan
        return found

    def _peaks(self, samples: Samples, cubics: Peaks | None = None) -> Peaks:
        return find_peaks(samples, max(self.tolerance, RELATIVE), cubics)

    def _samples_again(
        self, parameters: Array, starts: Array, after: Array, begin: Array
    ) -> Samples:
        """Return samples of members that start at some time.

        Args:
            parameters: Shape (parameters, m).
            starts: The states at the start, shape (states, m).
            after: The samples, counted from the start, shape (n,), s.
            begin: The time of the start, of shape () or (m, 1), s.
        """
        members = starts.shape[1]
        from_start = np.broadcast_to(begin.reshape(-1), (members,))
        trajectories = self.ensemble.run(parameters, starts, after, from_start)
        observed = self.ensemble.observe(parameters, trajectories, reuse=False)
        length = (after[-1] - after[0]) / (len(after) - 1)
        samples = self._samples(begin + after, length, parameters, trajectories.states, observed)
        for arrays in (samples.values, samples.rates):
            arrays[:, ~trajectories.done] = np.nan
        return samples

    def _samples(
        self,
        times: Array,
        length: float,
        parameters: Array,
        states: Array,
        observed: ObservedTrajectories,
    ) -> Samples:
        """Return samples that can be divided; `length` is that of all intervals, s."""

        def divide(members: Array, intervals: Array) -> Samples:
            begin = times[intervals] if times.ndim == 1 else times[members, intervals]
            starts = states[:, members, intervals]
            after = np.linspace(0.0, length, PARTS + 1)
            return self._samples_again(parameters[:, members], starts, after, begin[:, np.newaxis])

        return Samples(times, observed.values, observed.rates, divide)


def _of_members(samples: Samples, members: Array) -> Samples:
    return Samples(samples.times, samples.values[:, members], samples.rates[:, members])
