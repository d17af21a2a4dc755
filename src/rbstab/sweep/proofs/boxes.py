"""Proofs for many bodies of a sweep at once: for all those between the bounds of a box.

Such a proof says less of each body than its own proof, but takes a second or less for any number of
them. Where it fails, the members are divided in two along the number that widens its bounds most.
"""

from collections import deque
from collections.abc import Iterator, Mapping
from fractions import Fraction
from pathlib import Path as FilePath
from threading import Event
from time import monotonic
from typing import NamedTuple

import numpy as np

from rbstab.config.numbers import (
    Entry,
    entries_of,
    entries_under,
    is_of_initial_state,
    replaced,
)
from rbstab.config.schema import Config
from rbstab.config.source import Path
from rbstab.config.tolerances import Tolerance
from rbstab.experiment.robust.bodies import bodies_for
from rbstab.experiment.robust.record import BodiesRecord
from rbstab.mechanics.numbers import Array
from rbstab.sweep.plan.axes import varied_numbers
from rbstab.sweep.plan.plan import Plan
from rbstab.sweep.proofs.bodies import body_keys
from rbstab.sweep.proofs.variants import rows_of_variants, shares_proof, undecided_reason

SECONDS = 10.0
"""No box is begun after this time."""

PART_LIMIT = 2
"""A box is examined whole, then one half of it, only to find a body with several rest states.

What it does not decide is stored too: the next call goes on with the halves.
"""


class BoxProof(NamedTuple):
    """What is proved of all bodies of a box.

    Attributes:
        variant: Their variant.
        members: The numbers of the members of the sweep whose bodies lie in the box, ascending.
        whole: Whether these are all members of the variant.
        record: The proof, or a body in the box that has several rest states.
    """

    variant: str
    members: Array
    whole: bool
    record: BodiesRecord


def prove_boxes(
    plan: Plan, results: FilePath, seconds: float = SECONDS, stop: Event | None = None
) -> list[BoxProof]:
    """Prove of as many bodies of a plan as possible that they have one rest state.

    Variants are left out if all their members share a proof, if no theorem decides their motions,
    or if the plan varies something of them that is no number with a tolerance.

    Args:
        plan: The plan.
        results: The folder of results, which keeps the proofs.
        seconds: The time after which no box is begun.
        stop: Set by an interrupt; then no box is begun.

    Raises:
        StoreError: A proof cannot be written or read.
    """
    variants = [
        variant
        for variant in plan.variants
        if not shares_proof(plan, variant) and undecided_reason(plan, variant) is None
    ]
    begin, stop = monotonic(), stop or Event()
    keys = {varied.key for variant in variants for varied in body_keys(plan, variant)}
    proofs: list[BoxProof] = []
    parts = rows_of_variants(plan, variants, 0, plan.members, keys)
    for number, (variant, rows, values) in enumerate(parts, start=1):
        # A variant that fails leaves time for the next.
        end = begin + seconds * number / len(variants)
        try:
            boxes = _Boxes(plan, variant, rows, values)
        except (TypeError, ValueError, KeyError):
            continue  # something varies that is no number with a tolerance
        proofs += boxes.proofs(results, end, stop)
    return proofs


class _Boxes:
    """The bodies of one variant, divided into boxes."""

    def __init__(
        self, plan: Plan, variant: str, members: Array, values: Mapping[str, Array]
    ) -> None:
        self.variant, self.members = variant, members
        self.base, keys = plan.base_of(variant), body_keys(plan, variant)
        all_entries = (*entries_of(self.base), *entries_under(self.base, ("gravity",)))
        entries = {path: entry for entry in all_entries for path in entry.paths}
        # An error is raised where a value that matters is not a number with a tolerance.
        floats = {varied.key: values[varied.key].astype(float) for varied in keys}
        self.numbers = {
            entries[path]: numbers
            for path, numbers in varied_numbers(self.base, keys, floats).items()
            # The integration, for example, has no effect on rest states.
            if path[0] in ("body", "gravity", "controller", "elements")
            and path == entries[path].paths[0]
            and not is_of_initial_state(path)
        }

    def proofs(self, results: FilePath, end: float, stop: Event) -> Iterator[BoxProof]:
        """Prove boxes up to a time; yield the proved ones, and the whole if it is false."""
        waiting = deque([np.arange(len(self.members))])
        while waiting and monotonic() < end and not stop.is_set():
            rows = waiting.popleft()
            config, tolerances = self.box(rows)
            if not tolerances:
                continue  # one body, whose own proof says more
            try:
                record = bodies_for(results, config, tolerances, part_limit=PART_LIMIT)
            except (ArithmeticError, ValueError, LookupError, TypeError):
                continue  # as with proofs of one body, what raises such an error is not decided
            whole = len(rows) == len(self.members)
            if record.proved or (whole and record.proved is False):
                yield BoxProof(self.variant, self.members[rows], whole, record)
            if not record.proved and record.widest is not None:
                (numbers,) = (n[rows] for e, n in self.numbers.items() if e.key == record.widest)
                different = np.unique(numbers)
                below = numbers < different[len(different) // 2]
                waiting += [rows[below], rows[~below]]

    def box(self, rows: Array) -> tuple[Config, tuple[Tolerance, ...]]:
        """Return the config in the middle of some members, and the bounds of their numbers."""
        middles: dict[Path, float] = {}
        tolerances = []
        for entry, numbers in self.numbers.items():
            low, high = float(numbers[rows].min()), float(numbers[rows].max())
            middle = low if low == high else (low + high) / 2
            middles |= dict.fromkeys(entry.paths, middle)
            if low < high:
                tolerances.append(_tolerance(entry, low, middle, high))
        return replaced(self.base, middles), tuple(tolerances)


def _tolerance(entry: Entry, low: float, middle: float, high: float) -> Tolerance:
    """Return the bounds around a middle that hold both ends, as exact decimals."""
    ends = [Fraction(repr(end)) for end in (low, high)]
    centre = Fraction(repr(middle))
    return Tolerance(entry, centre, max(abs(end - centre) for end in ends))
