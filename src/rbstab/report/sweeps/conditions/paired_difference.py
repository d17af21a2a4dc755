"""The differences of a quantity between members that differ only in their condition."""

from typing import NamedTuple

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.report.sweeps.outcomes import CONFIDENCE
from rbstab.report.sweeps.quantiles import quantiles_of

MATTERS = 0.01
"""A median difference matters if it is at least this fraction of the values.

Gains, inertia and initial states of a real body are not known better than to about 1 %.
"""


class PairedDifference(NamedTuple):
    """Paired differences. Pairs with two equal values are counted, and have no part in the rest.

    A value may be infinite: later than the end of the run. Where only one of both is, it is known
    which is smaller, and the difference is infinite; where both are, the pair has no value.

    Attributes:
        pairs: The number of pairs in which both members have a value, and the values differ.
        equal: The number of pairs in which both values are the same.
        negative: The share of the differing pairs with a negative difference.
        median: The median of the differences; NaN without pairs.
        low: The lower end of its confidence interval; -inf if there are too few pairs.
        high: The upper end; likewise.
        scale: The larger median of the finite magnitudes of both members; 0 without any.
        ends: The values below and above which 5 % of the differences lie; NaN without pairs.
    """

    pairs: int
    equal: int
    negative: float
    median: float
    low: float
    high: float
    scale: float = 0.0
    ends: tuple[float, float] = (np.nan, np.nan)

    @property
    def is_sure(self) -> bool:
        """Whether the interval of the median excludes zero."""
        return self.low > 0 or self.high < 0

    @property
    def matters(self) -> bool:
        """Whether the median difference is large enough beside the values, see `MATTERS`."""
        return self.pairs > 0 and abs(self.median) >= MATTERS * self.scale

    def is_alike(self, *, sampled: bool) -> bool:
        """Return whether there is no difference that is sure and matters in most cases.

        Args:
            sampled: Whether the pairs are a sample; otherwise no interval says how sure it is.
        """
        is_sure = self.is_sure or not sampled
        return self.equal > self.pairs or not (is_sure and self.matters)


def paired_difference(first: Array, second: Array) -> PairedDifference:
    """Return the differences first - second.

    With ranks k and n + 1 - k of n sorted differences, the median lies between them unless fewer
    than k of the differences are on one side of it; that number is binomial with p = 1/2. As in the
    sign test, pairs with equal values are left out.

    A bootstrap of the pairs would draw n of them again and again, and take the quantiles of the
    medians. With infinitely many draws its interval has ends at the same ranks, or at the next ones
    inside: so the interval is that of the paired bootstrap, exact and without random numbers.

    Args:
        first: The quantity of the members of one condition, shape (n,).
        second: That of their partners.
    """
    with np.errstate(invalid="ignore"):
        difference = first - second
    equal = int(np.count_nonzero(difference == 0))
    differs = ~np.isnan(difference) & (difference != 0)
    difference = np.sort(difference[differs])
    count = len(difference)
    if not count:
        return PairedDifference(0, equal, np.nan, np.nan, -np.inf, np.inf)
    # Imported late: SciPy's statistics take longer to load than the rest of a report.
    from scipy.stats import binom

    rank = int(binom.ppf(0.5 * (1.0 - CONFIDENCE), count, 0.5))
    low, high = (-np.inf, np.inf) if rank < 1 else difference[[rank - 1, count - rank]].tolist()
    negative = float((difference < 0).mean())
    scale = max(_median_size(side[differs]) for side in (first, second))
    # The mean of both middle differences would be none if one of them is infinite.
    middle = difference[[(count - 1) // 2, count // 2]]
    median = float(middle.mean() if np.isfinite(middle).all() else middle[0])
    below, above = quantiles_of(difference, (0.05, 0.95))
    return PairedDifference(count, equal, negative, median, low, high, scale, (below, above))


def _median_size(values: Array) -> float:
    finite = np.abs(values[np.isfinite(values)])
    return float(np.median(finite)) if len(finite) else 0.0
