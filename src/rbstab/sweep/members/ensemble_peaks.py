"""The peaks of members that are integrated in batches.

A member is integrated again from a sample over one interval, to find a turning point that its
samples do not show accurately enough. In the first interval fast motions decay, so most members
need finer samples there. They are taken in the first integration.
If there are fewer intervals than steps of the integrator, the samples may not show all turning
points. Then the whole motion is sampled finer.
"""

from typing import NamedTuple

import numpy as np

from rbstab.analysis.peak_search import RELATIVE, Peaks, Samples, find_peaks, peaks_of_cubics
from rbstab.integrate.heyoka.compiled_map import SIMD
from rbstab.integrate.heyoka.ensemble.ensemble import Ensemble
from rbstab.integrate.heyoka.ensemble.trajectories import EnsembleTrajectories, ObservedTrajectories
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
        sampled = _Sampled(trajectories.states, observed.values, observed.rates)
        given = self._samples(times, parameters, sampled, trajectories)
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
                again = self._integrated(
                    parameters[:, chosen], starts[:, chosen], fine, np.zeros(len(chosen))
                )
                samples = self._samples(fine, parameters[:, chosen], again)
                cubics = peaks_of_cubics(_of_members(given, chosen))
                for target, part in zip(found, self._peaks(samples, cubics), strict=True):
                    target[:, chosen] = part
        found.error[:, too_fast] = np.nan
        return found

    def _peaks(self, samples: Samples, cubics: Peaks | None = None) -> Peaks:
        return find_peaks(samples, max(self.tolerance, RELATIVE), cubics)

    def _samples(
        self,
        times: Array,
        parameters: Array,
        sampled: "_Sampled",
        whole: EnsembleTrajectories | None = None,
    ) -> Samples:
        """Return samples that can be divided.

        Args:
            times: At equal distances, shape (n,) for all members, or (m, n), s.
            parameters: Shape (parameters, m).
            sampled: What is sampled.
            whole: The trajectories, if their first interval was divided during the integration.
        """
        length = float(times.flat[times.shape[-1] - 1] - times.flat[0]) / (times.shape[-1] - 1)

        def divide(members: Array, intervals: Array) -> Samples:
            begin = times[intervals] if times.ndim == 1 else times[members, intervals]
            after = np.linspace(0.0, length, PARTS + 1)
            chosen, starts = parameters[:, members], sampled.states[:, members, intervals]
            found = _Sampled.empty(len(starts), len(members), len(after))
            is_known = (intervals == 0) & (whole is not None and whole.first is not None)
            if whole is not None and is_known.any():
                first = whole.in_first_interval(members[is_known])
                found.put(is_known, self._observed(chosen[:, is_known], first))
            if not is_known.all():
                rows = ~is_known
                again = self._integrated(chosen[:, rows], starts[:, rows], after, begin[rows])
                found.put(rows, again)
            return self._samples(begin[:, np.newaxis] + after, chosen, found)

        return Samples(times, sampled.values, sampled.rates, divide)

    def _integrated(
        self, parameters: Array, starts: Array, after: Array, begin: Array
    ) -> "_Sampled":
        """Return what is sampled of members that start at some time.

        Args:
            parameters: Shape (parameters, m).
            starts: The states at the start, shape (states, m).
            after: The samples, counted from the start, shape (n,), s.
            begin: The time of the start, shape (m,), s.
        """
        trajectories = self.ensemble.run(parameters, starts, after, begin)
        return self._observed(parameters, trajectories)

    def _observed(self, parameters: Array, trajectories: EnsembleTrajectories) -> "_Sampled":
        """Return what is sampled of trajectories; values are NaN for those that are not done."""
        observed = self.ensemble.observer.observe(parameters, trajectories, reuse=False)
        for arrays in (observed.values, observed.rates):
            arrays[:, ~trajectories.done] = np.nan
        return _Sampled(trajectories.states, observed.values, observed.rates)


class _Sampled(NamedTuple):
    """What is sampled of m members, shape (rows, m, n) each.

    Attributes:
        states: The states.
        values: The quantities whose peaks are searched.
        rates: Their derivatives.
    """

    states: Array
    values: Array
    rates: Array

    @classmethod
    def empty(cls, states: int, members: int, samples: int) -> "_Sampled":
        """Return samples to be filled in."""
        return cls(*(np.empty((rows, members, samples)) for rows in (states, 6, 6)))

    def put(self, members: Array, other: "_Sampled") -> None:
        """Fill in the samples of some members."""
        for target, source in zip(self, other, strict=True):
            target[:, members] = source


def _of_members(samples: Samples, members: Array) -> Samples:
    return Samples(samples.times, samples.values[:, members], samples.rates[:, members])
