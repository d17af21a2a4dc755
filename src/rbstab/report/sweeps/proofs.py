"""What is proved of the convergence of members: a paragraph, a table, and words for a map."""

from typing import NamedTuple

import numpy as np

from rbstab.files.counts import grouped
from rbstab.mechanics.numbers import Array
from rbstab.report.model.document import Block, Cell, Head, Table
from rbstab.report.model.palette import BAD, GOOD, OPEN, SECOND, THIRD, UNKNOWN, UNTRIED
from rbstab.report.sweeps.members import Members
from rbstab.report.sweeps.table_entries import whole
from rbstab.sweep.proofs.bodies import named_members, ranges_of
from rbstab.sweep.proofs.columns import (
    FALSE,
    FIRST_UNDECIDED,
    MOTION_PROOFS,
    NO_PROOF,
    NOT_DECIDED,
    NOT_PROVED,
    PROVED,
)

MEANINGS = {
    PROVED: "converges to rest state {}: proved",
    FALSE: "does not come to rest: proved",
    NOT_DECIDED: "not decided",
    NOT_PROVED: "not proved at the start, motion not enclosed",
    NO_PROOF: "no proof of its own body, or one that ended early",
}
"""What each code of the column `convergence` says of a member, in the order of the table."""

REST_STATE_COLOURS = (GOOD, SECOND, THIRD)
"""Palette numbers of the rest states to which members are proved to converge; they repeat."""

COLOURS = {FALSE: BAD, NOT_DECIDED: OPEN, NOT_PROVED: UNTRIED, NO_PROOF: UNKNOWN}
"""Palette numbers of the other codes: red for what is false, greys for what is open, and sand for
what a proof could still tell."""

REASONS = {
    "step limit": "the enclosure reached its largest number of steps",
    "at rest": "the energy has almost stopped falling, outside of every certified region",
    "no step": "no further step of the enclosure could be proved",
    "no region": "no certified region is proved",
    "sliding": "the force of a sliding connector jumps",
    "failed": "the proof ended with an error",
    "switches": "an element switches",
    "user code": "an element is code of a user",
    "input": "an input supplies power",
}
"""The reasons why a member is not decided, by the words of the column `motion_proof`."""

NOTE = (
    "Proved means a theorem about the exact motion, with its hypotheses checked in rigorous "
    "arithmetic. Rest states are numbered from the lowest, as by rbstab stability. A "
    "member that is not proved may converge all the same."
)


class ProofCodes(NamedTuple):
    """What is proved of each member, as the index of a label.

    Attributes:
        labels: The labels that occur.
        codes: The index of each member's label, shape (n,).
        colours: The number of each label's colour in the palette.
    """

    labels: tuple[str, ...]
    codes: Array
    colours: tuple[int, ...]


def proof_codes(members: Members) -> ProofCodes:
    """Return what is proved of each member; proved members differ by their rest state."""
    convergence, rest_states = members.convergence, members.proved_rest_states
    labels: list[str] = []
    colours: list[int] = []
    codes = np.zeros(len(members), dtype=int)
    for code, meaning in MEANINGS.items():
        own = convergence == code
        numbers = np.unique(rest_states[own]) if code == PROVED else np.zeros(1, dtype=int)
        for place, number in enumerate(numbers.tolist()):
            chosen = own & (rest_states == number) if code == PROVED else own
            if chosen.any():
                codes[chosen] = len(labels)
                labels.append(meaning.format(number))
                repeating = REST_STATE_COLOURS[place % len(REST_STATE_COLOURS)]
                colours.append(COLOURS.get(code, repeating))
    return ProofCodes(tuple(labels), codes, tuple(colours))


def tried_members(convergence: Array) -> str:
    """Return of how many members a count of proved ones is: those with a proof of their body.

    What was not tried is not 0 of 1000.
    """
    tried, total = int(np.count_nonzero(convergence != NO_PROOF)), len(convergence)
    return (
        f"the {grouped(tried)} members that were tried"
        if 0 < tried < total
        else f"{grouped(total)} members"
    )


def proved_shares(members: Members) -> Array:
    """Return 1 for each member that is proved to converge, 0 for one that is not, shape (n,).

    It is NaN for a member whose body has no proof, neither alone nor with many others: nothing was
    tried, so that a share of 0 would be wrong.
    """
    tried = (members.convergence != NO_PROOF) | (members.box_levels > 0)
    return np.where(tried, (members.convergence == PROVED).astype(float), np.nan)


def proof_blocks(name: str, members: Members, command: str) -> list[Block]:
    """Return what is proved, in sentences and a table; nothing if the sweep has no proofs.

    Args:
        name: The anchor of the sweep.
        members: Its members.
        command: The command that makes proofs that are missing.
    """
    of_bodies = _of_bodies(members)
    if not (members.convergence != NO_PROOF).any():
        return of_bodies
    found = proof_codes(members)
    rows = [
        (Cell(label), whole(int(np.count_nonzero(found.codes == k))))
        for k, label in enumerate(found.labels)
    ]
    rows += [
        (Cell(f"of those not decided: {REASONS[word]}"), whole(count))
        for word, count in _reasons(members).items()
    ]
    heads = (Head("convergence of the exact motion"), Head("members", numbers=True))
    title = "What is proved of the members"
    table = Table(f"{name}-proofs", title, heads, tuple(rows), NOTE)
    return [_sentence(members, command), *of_bodies, table]


def _of_bodies(members: Members) -> list[Block]:
    """Return for how many bodies it is proved that they have one rest state; none if of no body."""
    sentences = members.one_state.sentences
    return [". ".join(sentences) + "."] if sentences else []


def _sentence(members: Members, command: str) -> str:
    convergence = members.convergence
    count = {code: int(np.count_nonzero(convergence == code)) for code in MEANINGS}
    of = tried_members(convergence)
    sentences = [f"{grouped(count[PROVED])} of {of} are proved to converge to a rest state"]
    if "proved_time" in members.table:
        later = int(((convergence == PROVED) & (members.column("proved_time") > 0)).sum())
        if later:
            some = "all" if later == count[PROVED] else grouped(later)
            sentences[0] += f", {some} of them by an enclosure of their exact motion"
    if count[FALSE]:
        sentences.append(f"{grouped(count[FALSE])} are proved not to come to rest")
    if count[NOT_DECIDED]:
        sentences.append(
            f"{grouped(count[NOT_DECIDED])} are not decided; the table has the reasons"
        )
    if count[NOT_PROVED]:
        sentences.append(
            f"{grouped(count[NOT_PROVED])} start in no certified region, and their "
            "motion was not enclosed"
        )
    untried = convergence == NO_PROOF
    for reason, own in members.undecidable.items():
        chosen = untried & own
        if chosen.any():
            sentences.append(f"{grouped(np.count_nonzero(chosen))} have no proof: {reason}")
            untried = untried & ~own
    if untried.any():
        named = named_members(ranges_of(np.flatnonzero(untried).tolist()))
        sentences.append(
            f"{grouped(np.count_nonzero(untried))} are not proved, because the proof of their own "
            f"body was not made, or ended early: {named}. {command} makes it"
        )
    return ". ".join(sentences) + "."


def _reasons(members: Members) -> dict[str, int]:
    """Return the number of undecided members by the reason, without reasons that do not occur."""
    if "motion_proof" not in members.table:
        return {}
    undecided = members.column("motion_proof")[members.convergence == NOT_DECIDED]
    counts = np.bincount(undecided, minlength=len(MOTION_PROOFS)).tolist()
    return {
        word: count
        for code, (word, count) in enumerate(zip(MOTION_PROOFS, counts, strict=False))
        if code >= FIRST_UNDECIDED and count
    }
