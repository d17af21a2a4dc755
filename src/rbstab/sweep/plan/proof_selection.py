"""Select the members whose exact motions are enclosed, and how far: the key `prove` of a plan."""

from dataclasses import dataclass
from math import gcd
from typing import Any

import numpy as np

from rbstab.experiment.convergence.decisions import MAX_STEPS
from rbstab.mechanics.numbers import Array
from rbstab.sweep.plan.problems import ProblemCollector

MOTION = "motion"

FORMS = "motion or {motion: {steps: n, members: n}}"

DEFAULT_STEPS = 400
"""The default of `steps`: more than the paper's starts and their neighbours need."""

LARGEST_STEPS = MAX_STEPS
"""The largest `steps`: the limit of a single run."""

GOLDEN_RATIO = 0.6180339887498949
"""(√5 - 1)/2. The fractional parts of its multiples are spread evenly, for any number of them."""


@dataclass(frozen=True)
class ProofSelection:
    """The members whose convergence is to be proved by an enclosure of their exact motion.

    Members that are proved at their start need no enclosure. The limits are numbers of steps and of
    members, never times, so what is proved does not depend on the speed of the machine.

    Args:
        steps: The largest number of steps of one enclosure.
        members: The number of members that may be enclosed, spread evenly over the plan; None: all.
    """

    steps: int = DEFAULT_STEPS
    members: int | None = None

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


def read_prove(problems: ProblemCollector) -> ProofSelection | None:
    """Return the selection of the key `prove`; None without the key or, with problems, if wrong."""
    data = problems.source.data
    if "prove" not in data:
        return None
    prove = data["prove"]
    if prove == MOTION:
        return ProofSelection()
    if not isinstance(prove, dict) or not prove:
        problems.add_unexpected(("prove",), prove, FORMS)
        return None
    problems.add_unknown_keys(("prove",), prove, (MOTION,))
    path, limits = ("prove", MOTION), prove.get(MOTION, {})
    if not isinstance(limits, dict) or (MOTION in prove and not limits):
        problems.add_unexpected(path, limits, "{steps: n, members: n}, or one of them")
        return None
    problems.add_unknown_keys(path, limits, ("steps", "members"))
    members = limits.get("members")
    if "members" in limits:
        members = problems.read_integer((*path, "members"), members, 1)
    return ProofSelection(_steps(problems, limits), members)


def _steps(problems: ProblemCollector, limits: dict[str, Any]) -> int:
    path = ("prove", MOTION, "steps")
    steps = problems.read_integer(path, limits.get("steps", DEFAULT_STEPS), 1)
    if steps is not None and steps > LARGEST_STEPS:
        problems.add_unexpected(path, steps, f"a number at most {LARGEST_STEPS}")
    return steps or DEFAULT_STEPS


def prove_data(prove: ProofSelection) -> dict[str, Any]:
    """Return a selection as plain data; read again, it is the same."""
    members = {} if prove.members is None else {"members": prove.members}
    return {MOTION: {"steps": prove.steps} | members}
