"""Sentences on the rest states of a body: how many are stable, and which ones are reached."""

import math
from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rbstab.experiment.stored_proof.almost_every_start import AlmostEveryStart
    from rbstab.experiment.stored_proof.data import ProofData
    from rbstab.proof.entries import ProvedState

ALMOST = "almost every start"
"""All starts but a set of measure zero."""

ROUND_OFF = 1e-9
"""rad: a smaller angle is printed as zero."""

KINDS = {True: "stable", False: "unstable", None: "not known to be stable"}
"""The kind of a rest state in a word, by `ProvedState.stable`."""


def capitalized(sentence: str) -> str:
    """Return a sentence with a capital letter at its begin."""
    return f"{sentence[:1].upper()}{sentence[1:]}"


def angles(Theta: Iterable[float]) -> str:
    """Return the angles of an attitude, rad, as text."""
    # Round-off is no angle, and zero has no sign.
    rounded = (0.0 if abs(angle) < ROUND_OFF else angle for angle in Theta)
    return "(" + ", ".join(f"{angle:.4g}" for angle in rounded) + ")"


def kinds_of(states: "Sequence[ProvedState]") -> str:
    """Return how many rest states there are of each kind, such as "1 stable, 4 unstable"."""
    kinds = [state.stable for state in states]
    counts = [(kinds.count(kind), word) for kind, word in KINDS.items()]
    return ", ".join(f"{count} {word}" for count, word in counts if count)


def counted_states(count: int) -> str:
    """Return a number of rest states as text."""
    return f"{count or 'no'} rest state{'s' if count > 1 else ''}"


def families_of(proof: "ProofData") -> str:
    """Return which families rest states form, such as "a surface of them at 2 J (index 1)"."""
    shapes = {1: "a curve of them", 2: "a surface of them", 3: "all rotations"}
    parts = [
        f"{shapes[family.dimension]} at {family.energy:.6g} J (index {family.index})"
        for family in proof.families
    ]
    return " and ".join(parts)


def other_family(proof: "ProofData") -> str | None:
    """Return a family of rest states as text: one without an unstable direction if there is one."""
    shapes = {1: "curve of rest states", 2: "surface of rest states", 3: "family of all rotations"}
    families = sorted(proof.families, key=lambda family: (family.index > 0, family.energy))
    if not families:
        return None
    first = families[0]
    kind = "an unstable" if first.index else "a"
    return f"{kind} {shapes[first.dimension]} at {first.energy:.6g} J (index {first.index})"


def counterexample(proof: "ProofData", rest_state: int | None = None) -> str | None:
    """Return a rest state at which a body can stay while another start ends elsewhere.

    Args:
        proof: The proof.
        rest_state: The number of that in which the other start ends; by default the lowest.

    Returns:
        It as text: a stable one if there is one. None if no other one is proved.
    """
    others = [other for other in _others(proof, rest_state) if other[1].proved]
    if not others:
        return None
    number, state = min(others, key=lambda other: (other[1].stable is not True, other[0]))
    where, kind = _named(number, state), KINDS[state.stable]
    return f"{where}, {kind}" if state.stable is None else f"the {kind} {where}"


def unproved_stable(proof: "ProofData", rest_state: int | None = None) -> str | None:
    """Return another stable rest state that a search found, where no stable one is proved.

    Args:
        proof: The proof.
        rest_state: The number of that in which a start ends; by default the lowest.
    """
    others = [other for other in _others(proof, rest_state) if other[1].index == 0]
    if not others or any(state.proved for _, state in others):
        return None
    return f"{_named(*others[0])}, stable and not proved"


def _others(proof: "ProofData", rest_state: int | None) -> "list[tuple[int, ProvedState]]":
    """Return all rest states but one, with their numbers."""
    return [pair for pair in enumerate(proof.states, start=1) if pair[0] != (rest_state or 1)]


def _named(number: int, state: "ProvedState") -> str:
    return f"rest state {number}, Θ = {angles(state.orientation)} rad"


def almost_sentence(proof: "ProofData", almost: "AlmostEveryStart") -> str:
    """Return what is proved of almost every start, without a full stop.

    Args:
        proof: The proof.
        almost: What follows from it; it is proved.
    """
    begins = f"{almost.outcome}: " if almost.outcome else ""
    all_but = f"{ALMOST} (all but a set of measure zero)"
    if proof.on_rotations is not None:
        scope = all_but
    elif proof.confined and proof.within_barriers:
        scope = f"{all_but} in the range, to which barriers confine every motion,"
    elif proof.confined:
        scope = f"{all_but} with |θ2| < 90°, to which {proof.kept_by} confines every motion,"
    else:
        lengths = " and from springs without length" if proof.needs_lengths else ""
        scope = f"{all_but} whose motion stays in the range and away from θ2 = ±90°{lengths}"
    return f"{begins}{scope} converges to {reached(proof, almost)}"


def exceptions(proof: "ProofData") -> str:
    """Return which rest states are not stable, without a full stop; empty if all are."""
    numbers = [n for n, state in enumerate(proof.states, start=1) if not state.stable]
    if proof.families:
        alone = ", ".join(f"rest state {number}" for number in numbers)
        families = families_of(proof).replace("of them", "of rest states")
        others = " and ".join(filter(None, (alone, families)))
        return f"the exceptions are {others}, and starts that lead to them"
    if not numbers:
        return ""
    if len(numbers) == 1:
        return f"the exceptions are the unstable rest state {numbers[0]} and starts that lead to it"
    in_a_row = len(numbers) > 2 and all(b == a + 1 for a, b in pairwise(numbers))
    listed = f"{numbers[0]} to {numbers[-1]}" if in_a_row else ", ".join(map(str, numbers))
    states = f"the {len(numbers)} unstable rest states ({listed})"
    return f"the exceptions are {states} and starts that lead to them"


def reached(proof: "ProofData", almost: "AlmostEveryStart") -> str:
    """Return the rest states that almost every start reaches, with their tilt."""
    low, high = (f"{math.degrees(tilt):.3g}" for tilt in almost.tilts)
    tilt = "at the desired attitude"
    if float(high) >= 0.1:
        between = low if low == high else f"{low}° to {high}"
        tilt = f"{between}° from the desired attitude"
    if len(proof.states) == 1 and not proof.families:
        return f"the only rest state {proof.place}, {tilt}"
    if len(almost.states) == 1:
        return f"rest state {almost.states[0]}, the only stable one {proof.place}, {tilt}"
    return f"one of the {len(almost.states)} stable rest states, {tilt}"


def every_motion(proof: "ProofData | None") -> str:
    """Return which motions converge to the only rest state, without a full stop.

    Args:
        proof: The proof; None if it is not known. Then it holds of all that stay in the range.
    """
    where, kept = "the only rest state in the range", ""
    if proof is not None:
        # Imported late: its hypotheses need the elements and the bounds of proofs.
        from rbstab.experiment.stored_proof.almost_every_start import almost_every_start

        almost = almost_every_start(proof)
        where = reached(proof, almost) if almost.proved else where
    if proof is not None and proof.kept_by:
        kept = f", which {proof.kept_by} keeps away from θ2 = ±π/2"
    keeps = keeps_distance(proof)
    keeps = f", and {keeps}" if keeps else ""
    return f"every motion that stays in the range{kept}{keeps}, converges to {where}"


def keeps_distance(proof: "ProofData | None") -> str:
    """Return from what a motion must keep a distance, as the end of a phrase; "" from nothing."""
    ends = [] if proof is not None and proof.kept_by else ["from θ2 = ±π/2"]
    if proof is not None and proof.needs_lengths:
        ends.append("from springs without length")
    return f"keeps a distance {' and '.join(ends)}" if ends else ""
