"""Select the members whose exact motions are enclosed, and how far: the key `prove` of a plan."""

from math import gcd
from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator, Field

from rbstab.config.quantities import Count, whole
from rbstab.config.section import Section
from rbstab.experiment.convergence.decisions import MAX_STEPS
from rbstab.mechanics.numbers import Array

DEFAULT_STEPS = 400
"""The default of `steps`: more than the paper's starts and their neighbours need."""

Steps = Annotated[
    int, Field(ge=1, le=MAX_STEPS, description="of one enclosure"), BeforeValidator(whole)
]
"""A number of steps; the largest is the limit of a single run."""

ALL: Any = Field(default=None)
"""The default of `members`."""

GOLDEN_RATIO = 0.6180339887498949
"""(√5 - 1)/2. The fractional parts of its multiples are spread evenly, for any number of them."""


class ProofSelection(Section):
    """The members whose convergence is to be proved by an enclosure of their exact motion.

    Members that are proved at their start need no enclosure. The limits are numbers of steps and of
    members, never times, so what is proved does not depend on the speed of the machine.

    Args:
        steps: The largest number of steps of one enclosure.
        members: The number of members that may be enclosed, spread evenly over the plan; None: all.
    """

    steps: Steps = DEFAULT_STEPS
    members: Count = ALL

    def selected(self, start: int, stop: int, total: int) -> Array:
        """Return whether each member from `start` up to `stop` is selected, shape (stop - start,).

        Member k·s mod `total` is the k-th that is selected, with s near the golden ratio of `total`
        and without a common divisor with it. So the first of them are spread evenly for any number
        of them, and a larger `members` selects more members beside the same ones.

        Args:
            start: The first member.
            stop: One after the last member, as in `range`.
            total: The number of members of the plan.
        """
        numbers = np.arange(start, stop, dtype=np.int64)
        if self.members is None or self.members >= total:
            return np.ones(len(numbers), dtype=bool)
        order = numbers * pow(_stride(total), -1, total) % total
        chosen: Array = order < self.members
        return chosen

    def count(self, total: int) -> int:
        """Return how many members are selected in a plan with this number of members."""
        return total if self.members is None else min(self.members, total)

    def first(self, count: int, total: int) -> list[int]:
        """Return the first `count` members that are selected, or all if there are fewer."""
        stride = _stride(total)
        return [k * stride % total for k in range(min(count, self.count(total)))]


def _stride(total: int) -> int:
    """Return a number near `GOLDEN_RATIO` times the total, without a common divisor with it."""
    stride = max(1, round(GOLDEN_RATIO * total))
    while gcd(stride, total) != 1:
        stride += 1
    return stride
