"""For which bodies of a sweep it is proved that they have one rest state, by any of their proofs.

These are proofs of single bodies, and proofs for many bodies at once (`boxes`).
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from rbstab.experiment.answers.words import Sureness
from rbstab.experiment.robust.record import BodiesRecord
from rbstab.experiment.robust.sentences import named_body
from rbstab.files.text import grouped
from rbstab.mechanics.numbers import Array
from rbstab.sweep.proofs.bodies import bodies_of, named_members, ranges_of
from rbstab.sweep.proofs.columns import NOT_SOLE_STATE, SOLE_STATE, STATES_UNDECIDED
from rbstab.sweep.proofs.convergence import MemberConvergence, ProvedConvergence
from rbstab.sweep.proofs.variants import members_of_variants


class SoleState(NamedTuple):
    """Which distinct bodies of a sweep have one rest state in the range, a minimum.

    Variants whose members all share a proof are left out.

    Attributes:
        bodies: The number of distinct bodies; 0 if nothing is decided of any of them.
        proved: Of how many it is proved.
        false: The first member of each body of which it is proved to be false, ascending.
        levels: The level of each body that was proved among many, J: its motions with v(0) below it
            converge.
        counterexamples: By variant, a body between the bounds of the plan of which it is false. It
            need not be a body of the sweep.
        of_variants: Whether the sweep has several variants, so that they are named.
    """

    bodies: int = 0
    proved: int = 0
    false: Sequence[int] = ()
    levels: Sequence[float] = ()
    counterexamples: dict[str, BodiesRecord] = {}  # noqa: RUF012 (never changed)
    of_variants: bool = False

    @property
    def not_decided(self) -> int:
        """The number of bodies of which it is neither proved nor refuted."""
        return self.bodies - self.proved - len(self.false)

    @property
    def word(self) -> str:
        """The answer for all bodies in a word, with a number if it is proved of some of them."""
        if self.false:
            return str(Sureness.FALSE)
        if self.proved == self.bodies:
            return str(Sureness.PROVED)
        count = f"{grouped(self.proved)} of {grouped(self.bodies)} {Sureness.PROVED}"
        return count if self.proved else str(Sureness.NOT_DECIDED)

    @property
    def counts(self) -> str:
        """The number of bodies with each answer: `proved for 3 of 4 distinct bodies, ...`."""
        what = "distinct body" if self.bodies == 1 else "distinct bodies"
        shown = [f"{Sureness.PROVED} for {grouped(self.proved)} of {grouped(self.bodies)} {what}"]
        if len(self.levels) and len(self.levels) < self.proved:
            shown[0] += f" ({grouped(len(self.levels))} of them many at once)"
        if self.false:
            named = named_members(ranges_of(self.false))
            shown.append(f"{Sureness.FALSE} for {grouped(len(self.false))} ({named})")
        if self.not_decided:
            shown.append(f"{Sureness.NOT_DECIDED} for {grouped(self.not_decided)}")
        return ", ".join(shown)

    @property
    def refutations(self) -> list[str]:
        """Sentences with a counterexample to a claim on all bodies between the bounds of a plan."""
        return [
            f"For every body{f' of variant {variant}' if self.of_variants else ''} between the "
            "least and the greatest value of each number of the plan: one rest state, a minimum: "
            f"{Sureness.FALSE}, proved. {named_body(record)}"
            for variant, record in self.counterexamples.items()
        ]

    @property
    def sentences(self) -> list[str]:
        """Sentences without their ends: the number of bodies with each answer, and refutations."""
        if not self.bodies:
            return []
        first = f"One rest state in the range of the Euler angles, a minimum: {self.counts}"
        return [first, *self.refutations]

    @property
    def data(self) -> dict[str, Any]:
        """The same as data for JSON."""
        return {
            "bodies": self.bodies,
            "proved": self.proved,
            "false": len(self.false),
            "not_decided": self.not_decided,
            "false_members": ranges_of(self.false),
            "counterexamples": [
                {"variant": variant, "body": record.body, "rest_states": record.rest_states}
                for variant, record in self.counterexamples.items()
            ],
        }


def sole_state_of(proofs: ProvedConvergence, convergence: MemberConvergence) -> SoleState:
    """Return which distinct bodies of a sweep have one rest state.

    Args:
        proofs: The proofs in the folder of results.
        convergence: What is known of all members, with what proofs of single bodies say.
    """
    count = len(convergence.sole_state)
    of_bodies = members_of_variants(proofs.plan, proofs.boxes.variants)
    body_codes: Array = np.where(of_bodies, convergence.sole_state, 0)
    levels, of_boxes = proofs.boxes.of(0, count)
    codes = np.where(of_boxes == STATES_UNDECIDED, body_codes, of_boxes)
    counterexamples = proofs.boxes.counterexamples()
    if not codes.any() and not counterexamples:
        return SoleState()
    first = bodies_of(proofs.plan, proofs.boxes.variants).first
    levels = levels[first]
    return SoleState(
        len(first),
        int(np.count_nonzero(codes[first] == SOLE_STATE)),
        first[codes[first] == NOT_SOLE_STATE].tolist(),
        levels[levels > 0].tolist(),
        counterexamples,
        len(proofs.plan.variants) > 1,
    )
