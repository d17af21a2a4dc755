"""What is proved of the convergence of members: a table, and words for a map."""

import numpy as np

from rbstab.experiment.answers.rounded import rounded_down
from rbstab.report.model.document import Block, Table
from rbstab.report.model.figure import Axis
from rbstab.report.model.palette import BAD, GOOD, OPEN, SECOND, THIRD, UNKNOWN, UNTRIED
from rbstab.report.sweeps.members import Members, kept
from rbstab.report.sweeps.quantities import MemberQuantity
from rbstab.sweep.proofs.bodies import named_members, ranges_of
from rbstab.sweep.proofs.columns import (
    FALSE,
    MOTION_PROOFS,
    NO_PROOF,
    NOT_DECIDED,
    NOT_PROVED,
    PROVED,
)
from rbstab.sweep.proofs.sole_state import SoleState

MEANINGS = {
    PROVED: ("converges to rest state {}: proved", GOOD),
    FALSE: ("does not come to rest: proved", BAD),
    NOT_DECIDED: ("not decided", OPEN),
    NOT_PROVED: ("not proved at the start, motion not enclosed", UNTRIED),
    NO_PROOF: ("no proof of its own body, or one that ended early", UNKNOWN),
}
"""What each code of the column `convergence` says of a member, in the order of the table, and its
number in the palette: red for what is false, greys for what is open, sand for what a proof could
still tell.
"""

REST_STATE_COLOURS = (GOOD, SECOND, THIRD)
"""Palette numbers of the rest states to which members are proved to converge; they repeat."""

REASONS = {
    "step limit": "the enclosure reached its largest number of steps",
    "at rest": "the energy has almost stopped falling, outside of every certified region",
    "no step": "no further step of the enclosure could be proved",
    "no region": "no certified region is proved",
    "sliding": "the force of a sliding connector jumps",
    "failed": "the proof ended with an error",
    "switches": "an element switches",
    "user code": "an element is code of a user",
    "input": "an element supplies power",
}
"""The reasons why a member is not decided, by the words of the column `motion_proof`."""

WHAT = "convergence of the exact motion"

NOTE = (
    "Proved means a theorem about the exact motion, with its hypotheses checked in rigorous "
    "arithmetic. Rest states are numbered from the lowest, as by rbstab stability. A "
    "member that is not proved may converge all the same."
)


@kept
def proof_words(members: Members) -> MemberQuantity:
    """Return what is proved of each member; proved members differ by their rest state.

    Of several members it is the share that is proved to converge. A member whose body has no proof,
    neither alone nor with many others, has no part in it: nothing was tried.
    """
    convergence, rest_states = members.convergence, members.proved_rest_states
    labels: list[str] = []
    colours: list[int] = []
    codes = np.zeros(len(members))
    for code, (meaning, colour) in MEANINGS.items():
        mask = convergence == code
        states = np.where(mask & (code == PROVED), rest_states, 0)
        for place, number in enumerate(np.unique(states[mask]).tolist()):
            codes[mask & (states == number)] = len(labels)
            labels.append(meaning.format(number))
            repeating = REST_STATE_COLOURS[place % len(REST_STATE_COLOURS)]
            colours.append(repeating if code == PROVED else colour)
    axis = Axis(WHAT, categories=tuple(labels), colours=tuple(colours))
    tried = (convergence != NO_PROOF) | (members.box_levels > 0)
    share = "share proved to converge", np.where(tried, convergence == PROVED, np.nan)
    return MemberQuantity("proofs", axis, codes, "no proof of the bodies", share=share)


def proof_blocks(name: str, members: Members, command: str) -> list[Block]:
    """Return what is proved: sentences on bodies, then a table on members, or why there is none.

    Args:
        name: The anchor of the sweep.
        members: Its members.
        command: The command that makes proofs that are missing.
    """
    of_bodies = [f"{'. '.join(text)}." for text in [_of_bodies(members)] if text]
    convergence = members.convergence
    untried = convergence == NO_PROOF
    reasons = {}
    for reason, mask in members.undecidable.items():
        reasons[reason] = int(np.count_nonzero(untried & mask))
        untried = untried & ~mask
    missing = ""
    if untried.any():
        named = named_members(ranges_of(np.flatnonzero(untried).tolist()))
        every = "any member" if untried.all() else named
        missing = f"No proof was made of the bodies of {every}: {command} makes it."
    if (convergence == NO_PROOF).all():
        why = "an element supplies power, so v may rise" if members.driven else "; ".join(reasons)
        return [*of_bodies, f"Convergence is not proved: {why}." if why else missing]
    quantity = proof_words(members)
    rows = dict(
        zip(
            quantity.axis.categories, np.bincount(quantity.values.astype(int)).tolist(), strict=True
        )
    )
    if "proved_time" in members.table:
        later = (convergence == PROVED) & (members.column("proved_time") > 0)
        rows["of those proved: by an enclosure of their motion"] = int(np.count_nonzero(later))
    if "motion_proof" in members.table:
        ends, counts = np.unique(
            members.column("motion_proof")[convergence == NOT_DECIDED], return_counts=True
        )
        words = (REASONS.get(MOTION_PROOFS[end], "") for end in ends.tolist())
        reasons_of = zip(words, counts.tolist(), strict=True)
        rows |= {f"of those not decided: {word}": n for word, n in reasons_of if word}
    rows |= {f"of those without a proof: {reason}": n for reason, n in reasons.items()}
    title, note = "What is proved of the members", f"{NOTE} {missing}".strip()
    shown = [row for row in rows.items() if row[1]]
    return [*of_bodies, Table.of(f"{name}-proofs", title, (WHAT, "members"), shown, note)]


def _of_bodies(members: Members) -> list[str]:
    """Return for how many bodies it is proved that they have one rest state; none if of no body."""
    bodies = members.sole_state
    if not bodies.proved:
        return bodies.sentences
    first, *refutations = bodies.sentences
    return [
        first,
        "Each motion of a proved body that stays in the range, and keeps a distance from its end "
        "in θ2, converges to its rest state",
        *_level(members, bodies),
        *refutations,
    ]


def _level(members: Members, bodies: SoleState) -> list[str]:
    """Return below which v(0) motions of bodies that were proved among many converge."""
    # Of older sweeps, v may count from elsewhere.
    if not len(bodies.levels) or "rest_orientation" not in members.table:
        return []
    least, most = rounded_down(min(bodies.levels)), rounded_down(max(bodies.levels))
    bound = f"{least} J" if least == most else f"{least} J (of some bodies up to {most} J)"
    every = len(bodies.levels) == bodies.proved
    whose = "So does each motion" if every else "Of those proved at once, so does each motion"
    return [f"{whose} that starts in the range with v(0) below {bound}"]
