"""Search for the peaks of sampled motions between their samples.

A peak is a sample or a turning point. Turning points are interpolated from the samples. If the
estimated error is too large, more samples are used. If it is still too large, the motion is sampled
finer around the turning point, again and again.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from rbstab.analysis.peaks import indices_of_largest, peaks_at_samples
from rbstab.analysis.turning_points import TurningPoints, through_more_samples, turning_points
from rbstab.mechanics.numbers import Array

RELATIVE = 1e-5
"""The error of a peak is at most this times the peak, or `ABSOLUTE` if that is more."""

ABSOLUTE = 1e-9
"""m or rad."""

STEPS_PER_INTERVAL = {"heyoka": 1, "scipy": 8}
"""By engine, the most steps between two samples that show all turning points. A Taylor step is
longer."""

SAFETY = 4.0
"""A point is no peak if it would be too low even with an error of this times the estimate."""

MAX_DIVISIONS = 6
"""How often an interval between two samples is divided at most."""


class Samples(NamedTuple):
    """Samples of q quantities of m members.

    Attributes:
        times: Shape (n,) for all members, or (m, n), s.
        values: Shape (q, m, n).
        rates: The derivatives of the values, shape (q, m, n).
        divide: Returns finer samples of some intervals, given the number of a member and the number
            of an interval, both of shape (p,). The result has one member for each interval. It is
            NaN where it cannot be computed. None if there are no finer samples.
    """

    times: Array
    values: Array
    rates: Array
    divide: "Callable[[Array, Array], Samples] | None" = None


class Peaks(NamedTuple):
    """The values of quantities farthest from zero, of shape (quantities, m) each.

    Attributes:
        value: With its sign.
        time: s.
        error: The estimated error of the value; NaN if it is unknown.
    """

    value: Array
    time: Array
    error: Array


def find_peaks(samples: Samples, tolerance: float = RELATIVE, cubics: Peaks | None = None) -> Peaks:
    """Return the peaks of all quantities.

    If the cubics between the samples give a peak within the tolerance, it is returned.

    Args:
        samples: The samples; the times have the shape (n,).
        tolerance: The largest error of a peak, relative to the peak.
        cubics: The peaks of the cubics; default those of `samples`.
    """
    search = _Search(samples, tolerance)
    found = search.candidates()
    if cubics is None:
        indices = search.indices.reshape(samples.values.shape[:2])
        cubics = peaks_of_cubics(samples, indices)
    return search.chosen(found, cubics)


def peaks_of_cubics(samples: Samples, indices: Array | None = None) -> Peaks:
    """Return the peaks of the cubic interpolants, with unknown errors (see `peaks_at_samples`).

    Args:
        samples: The samples; the times have the shape (n,).
        indices: The largest sample of each quantity and member, shape (q, m), if it is known.
    """
    value, time = peaks_at_samples(samples.times, samples.values, samples.rates, indices)
    return Peaks(value, time, np.full(value.shape, np.nan))


class _Candidates(NamedTuple):
    """Turning points that may be peaks, shape (p,) each.

    `signal` is the number of a quantity times m plus the number of a member. `row` and `interval`
    say where the point is in the finest samples.
    """

    signal: Array
    row: Array
    interval: Array
    time: Array
    value: Array
    error: Array

    @classmethod
    def of(cls, found: TurningPoints, signals: Array, rows: Array) -> "_Candidates":
        """Return turning points as candidates; their rows have these signals and sample rows."""
        signal, row = signals[found.row], rows[found.row]
        return cls(signal, row, found.interval, found.time, found.value, found.error)

    def where(self, chosen: Array) -> "_Candidates":
        """Return some candidates."""
        return _Candidates(*(array[chosen] for array in self))


def _joined(parts: Sequence[_Candidates]) -> _Candidates:
    return _Candidates(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))


class _Search:
    """The search for the peaks of all members.

    Signal number i is quantity i // m of member i % m.

    Attributes:
        values: The samples of all signals, shape (q * m, n).
        rates: Their rates, in the same form.
        indices: The largest sample of each signal, shape (q * m,).
        at_samples: The values of these samples, shape (q * m,).
        largest: A lower bound of the magnitude of each peak, shape (q * m,).
    """

    def __init__(self, samples: Samples, tolerance: float) -> None:
        self.samples = samples
        self.tolerance = tolerance
        self.members, count = samples.values.shape[1:]
        self.values = samples.values.reshape(-1, count)
        self.rates = samples.rates.reshape(-1, count)
        self.indices = indices_of_largest(self.values)
        self.at_samples = self.values[np.arange(len(self.values)), self.indices]
        self.largest = np.abs(self.at_samples)

    def candidates(self) -> _Candidates:
        """Return all turning points that may be peaks, as accurate as possible."""
        samples, signals = self.samples, np.arange(len(self.values))
        lowest = self._lowest(signals)
        found = turning_points(samples.times, self.values, self.rates, lowest, self.indices)
        done: list[_Candidates] = []
        open_ = self._sorted_out(_Candidates.of(found, signals, signals % self.members), done)
        open_ = self._sorted_out(self._through_more_samples(open_), done)
        for _ in range(MAX_DIVISIONS):
            if samples.divide is None or not len(open_.row):
                break
            samples, open_, failed = self._divided(samples, open_)
            done.append(failed)
            open_ = self._sorted_out(open_, done)
        return _joined([*done, open_])

    def _sorted_out(self, found: _Candidates, done: list[_Candidates]) -> _Candidates:
        """Move candidates that are accurate enough to a list, and return the open ones.

        Open candidates that are too low for a peak are left out.
        """
        resolved = found.error <= self._tolerance(self.largest[found.signal])
        done.append(found.where(resolved))
        # An estimate that is not small may be too small, so only resolved points count here.
        np.fmax.at(self.largest, done[-1].signal, np.abs(done[-1].value) - done[-1].error)
        open_ = found.where(~resolved)
        upper = np.abs(open_.value) + SAFETY * open_.error
        return open_.where(~(upper < self.largest[open_.signal]))

    def _through_more_samples(self, found: _Candidates) -> _Candidates:
        """Return candidates between the samples of the search, interpolated more accurately."""
        points = TurningPoints(found.signal, *found[2:])
        better = through_more_samples(self.samples.times, self.values, self.rates, points)
        return found._replace(time=better.time, value=better.value, error=better.error)

    def chosen(self, found: _Candidates, cubics: Peaks) -> Peaks:
        """Return the peaks of the cubics, replaced by candidates or samples where they are wrong.

        Args:
            found: The candidates.
            cubics: The peaks of the cubics.
        """
        value, time = cubics.value.ravel(), cubics.time.ravel()
        magnitude = np.abs(self.at_samples)
        upper = magnitude.copy()
        np.maximum.at(magnitude, found.signal, np.abs(found.value))
        np.maximum.at(upper, found.signal, np.abs(found.value) + found.error)
        tolerance = self._tolerance(magnitude)
        wrong = np.abs(np.abs(value) - magnitude) > tolerance
        at = self.samples.times[self.indices]
        value, time = np.where(wrong, self.at_samples, value), np.where(wrong, at, time)
        # Of several points that are alike within the tolerance, take the first.
        alike = np.abs(found.value) >= (magnitude - tolerance)[found.signal]
        peaks = found.where(wrong[found.signal] & alike)
        peaks = peaks.where(np.argsort(-peaks.time, kind="stable"))
        value[peaks.signal], time[peaks.signal] = peaks.value, peaks.time
        error = upper - magnitude + np.abs(np.abs(value) - magnitude)
        return Peaks(*(array.reshape(cubics.value.shape) for array in (value, time, error)))

    def _tolerance(self, magnitude: Array) -> Array:
        """Return half of the allowed error: the choice among peaks may add the other half."""
        return 0.5 * np.maximum(self.tolerance * magnitude, ABSOLUTE)

    def _lowest(self, signals: Array) -> Array:
        """Return what a turning point must reach at least.

        A quantity that is zero but for round-off has many turning points and no peak.
        """
        return np.maximum(self.largest[signals], ABSOLUTE)

    def _divided(
        self, samples: Samples, found: _Candidates
    ) -> tuple[Samples, _Candidates, _Candidates]:
        """Return finer samples, the candidates between them, and those without finer samples."""
        assert samples.divide is not None
        intervals = samples.times.shape[-1]
        keys, rows = np.unique(found.row * intervals + found.interval, return_inverse=True)
        finer = samples.divide(keys // intervals, keys % intervals)
        finite: Array = np.isfinite(finer.values) & np.isfinite(finer.rates)
        is_finite = np.asarray(finite.all(axis=(0, 2)))
        chosen = is_finite[rows]
        signals, rows = found.signal[chosen], rows[chosen]
        quantities = signals // self.members
        values, rates = finer.values[quantities, rows], finer.rates[quantities, rows]
        between = turning_points(
            finer.times[rows], values, rates, self._lowest(signals), indices_of_largest(values)
        )
        return finer, _Candidates.of(between, signals, rows), found.where(~chosen)
