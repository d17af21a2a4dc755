"""Search for the peaks of sampled motions between their samples.

A peak is a sample or a turning point. Turning points are interpolated from the samples. If the
estimated error is too large, the motion is sampled finer around the turning point, again and again.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from rbstab.analysis.peaks import indices_of_largest, peaks_at_samples
from rbstab.analysis.turning_points import Signals, longest_interval, turning_points
from rbstab.mechanics.numbers import Array

RELATIVE = 1e-5
"""The error of a peak is at most this times the peak, or `ABSOLUTE` if that is more."""

ABSOLUTE = 1e-9
"""m or rad."""

SAFETY = 4.0
"""A point is no peak if it would be too low even with an error of this times the estimate."""

MAX_DIVISIONS = 6
"""How often an interval between two samples is divided at most."""

SIGNALS_TOGETHER = 64
"""All quantities of so few signals are searched together."""


class Samples(NamedTuple):
    """Sampled quantities of m members.

    Attributes:
        times: Shape (n,) for all members, or (m, n), s.
        values: For each quantity an array of shape (m, n).
        rates: The derivatives of the values, in the same form.
        divide: Returns finer samples of some intervals, given the number of a member and the number
            of an interval, both of shape (p,). The result has one member for each interval. It is
            NaN where it cannot be computed. None if there are no finer samples.
    """

    times: Array
    values: Sequence[Array]
    rates: Sequence[Array]
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
    return search.chosen(found, cubics or peaks_of_cubics(samples, search.indices))


def peaks_of_cubics(samples: Samples, indices: Sequence[Array] | None = None) -> Peaks:
    """Return the peaks of the cubic interpolants, with unknown errors (see `peaks_at_samples`).

    Args:
        samples: The samples; the times have the shape (n,).
        indices: The largest sample of each quantity and member, if it is known.
    """
    if len(samples.values) * len(samples.values[0]) <= SIGNALS_TOGETHER:
        values, rates = np.array(samples.values), np.array(samples.rates)
        together = None if indices is None else np.array(indices)
        value, time = peaks_at_samples(samples.times, values, rates, together)
        return Peaks(value, time, np.full(value.shape, np.nan))
    found = [
        peaks_at_samples(samples.times, values, rates, None if indices is None else indices[k])
        for k, (values, rates) in enumerate(zip(samples.values, samples.rates, strict=True))
    ]
    value, time = (np.array([one[part] for one in found]) for part in (0, 1))
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

    def where(self, chosen: Array) -> "_Candidates":
        return _Candidates(*(array[chosen] for array in self))


class _Group(NamedTuple):
    """Signals of one quantity: members of some samples, and the signal of each, shape (r,)."""

    quantity: int
    rows: Array
    signals: Array


def _concatenated(arrays: Sequence[Array]) -> Array:
    """Return arrays one after the other; a single array is not copied."""
    return arrays[0] if len(arrays) == 1 else np.concatenate(arrays)


def _joined(parts: Sequence[_Candidates]) -> _Candidates:
    return _Candidates(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))


class _Search:
    """The search for the peaks of all members.

    Attributes:
        indices: The largest sample of each quantity and member, arrays of shape (m,).
        at_samples: The values of these samples, shape (quantities * m,).
        largest: A lower bound of the magnitude of each peak, in the same order.
    """

    def __init__(self, samples: Samples, tolerance: float) -> None:
        self.samples = samples
        self.tolerance = tolerance
        self.members = len(samples.values[0])
        self.indices = [indices_of_largest(values) for values in samples.values]
        rows = np.arange(self.members)
        pairs = zip(samples.values, self.indices, strict=True)
        self.at_samples = np.concatenate([values[rows, at] for values, at in pairs])
        self.largest = np.abs(self.at_samples)

    def candidates(self) -> _Candidates:
        """Return all turning points that may be peaks, as accurate as possible."""
        samples, everyone = self.samples, np.arange(self.members)
        starts = range(0, len(self.largest), self.members)
        groups = [_Group(k, everyone, start + everyone) for k, start in enumerate(starts)]
        # The arrays of many members are too large to be copied for one search.
        together = len(self.largest) <= SIGNALS_TOGETHER
        calls = [groups] if together else [[group] for group in groups]
        open_, done = _joined([self._between(samples, call) for call in calls]), []
        for divisions in range(MAX_DIVISIONS + 1):
            resolved = open_.error <= self._tolerance(self.largest[open_.signal])
            done.append(open_.where(resolved))
            # An estimate that is not small may be too small, so only resolved points count here.
            np.fmax.at(self.largest, done[-1].signal, np.abs(done[-1].value) - done[-1].error)
            open_ = open_.where(~resolved)
            upper = np.abs(open_.value) + SAFETY * open_.error
            open_ = open_.where(~(upper < self.largest[open_.signal]))
            if samples.divide is None or divisions == MAX_DIVISIONS or not len(open_.row):
                break
            samples, open_, failed = self._divided(samples, open_)
            done.append(failed)
        return _joined([*done, open_])

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
        at = self.samples.times[np.concatenate(self.indices)]
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

    def _between(self, samples: Samples, groups: Sequence[_Group]) -> _Candidates:
        """Return the candidates of some signals between samples.

        The signals of all groups are searched together, because each search takes many calls of
        numpy.
        """
        rows = _concatenated([group.rows for group in groups])
        signals = _concatenated([group.signals for group in groups])
        quantities = [group.quantity for group in groups]
        values, rates = (
            [arrays[quantity] for quantity in quantities]
            for arrays in (samples.values, samples.rates)
        )
        times, longest = samples.times, None
        if samples is self.samples:
            indices = _concatenated([self.indices[quantity] for quantity in quantities])
        else:
            chosen = [group.rows for group in groups]
            values, rates = (
                [array[of_group] for array, of_group in zip(arrays, chosen, strict=True)]
                for arrays in (values, rates)
            )
            lengths = [longest_interval(times[of_group]) for of_group in chosen]
            longest = np.repeat(lengths, [len(of_group) for of_group in chosen])
            times = times[rows]
            indices = indices_of_largest(np.concatenate(values))
        # A quantity that is zero but for round-off has many turning points and no peak.
        lowest = np.maximum(self.largest[signals], ABSOLUTE)
        sampled = Signals(times, _concatenated(values), _concatenated(rates))
        found = turning_points(sampled, lowest, indices, longest)
        row, signal = rows[found.row], signals[found.row]
        return _Candidates(signal, row, found.interval, found.time, found.value, found.error)

    def _divided(
        self, samples: Samples, found: _Candidates
    ) -> tuple[Samples, _Candidates, _Candidates]:
        """Return finer samples, the candidates between them, and those without finer samples."""
        assert samples.divide is not None
        intervals = samples.times.shape[-1]
        keys, rows = np.unique(found.row * intervals + found.interval, return_inverse=True)
        finer = samples.divide(keys // intervals, keys % intervals)
        quantities = found.signal // self.members
        is_finite = np.all([np.isfinite(array).all(axis=1) for array in finer.values], axis=0)
        is_finite &= np.all([np.isfinite(array).all(axis=1) for array in finer.rates], axis=0)
        groups = []
        for quantity in range(len(finer.values)):
            chosen = (quantities == quantity) & is_finite[rows]
            groups.append(_Group(quantity, rows[chosen], found.signal[chosen]))
        return finer, self._between(finer, groups), found.where(~is_finite[rows])
