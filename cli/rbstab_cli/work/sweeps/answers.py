"""What is proved of the members of a sweep after its results are stored, as sentences and data."""

from collections import Counter
from threading import Event
from typing import Any, NamedTuple

import numpy as np

from rbstab.experiment.answers.rounded import rounded_down
from rbstab.experiment.robust.sentences import sentences_of
from rbstab.files.text import grouped
from rbstab.processes import processors
from rbstab.report.model.words import counted
from rbstab.sweep.folder.member_answers import MAX_COUNTED
from rbstab.sweep.plan.plan import Plan
from rbstab.sweep.proofs import prove_bodies
from rbstab.sweep.proofs.bodies import bodies_of, named_members, ranges_of
from rbstab.sweep.proofs.columns import (
    CONVERGENCE,
    FALSE,
    NO_PROOF,
    NOT_DECIDED,
    NOT_PROVED,
    PROVED,
)
from rbstab.sweep.proofs.convergence import ProvedConvergence, keep_proofs
from rbstab.sweep.proofs.prove_bodies import BodyProofs
from rbstab.sweep.proofs.variants import shares_proof, undecided_reason
from rbstab.sweep.sweep import Sweep, prove_members, store_convergence
from rbstab_cli.interrupts import graceful_interrupts
from rbstab_cli.output.progress import working
from rbstab_cli.printing import hint

Counts = Counter[int]
"""The number of members with each code of the column `convergence`."""

SENTENCES = {
    PROVED: "proved for {} of the members: they start in a certified region",
    FALSE: "proved to be false for {} of the members: there is no rest state",
    NOT_DECIDED: "not decided for {} of the members: their motions were enclosed without reaching "
    "a certified region",
    NOT_PROVED: "not proved for {} of the members: they start outside of every certified region. A "
    "plan with `prove: motion` encloses such motions too, unless elements switch; that is another "
    "sweep, so give it another folder with -o",
    NO_PROOF: "not proved for {} of the members: no proof covers them",
}


class Answers(NamedTuple):
    """What is proved of the members: sentences, and the same as data for JSON.

    missing says which proofs an interrupt has prevented; it is empty if there was none.
    """

    sentences: list[str]
    data: dict[str, Any]
    missing: str = ""


def prove_and_tell(plan: Plan, sweep: Sweep, *, unlimited: bool) -> Answers:
    """Prove the rest states of the bodies of a finished sweep, and count the proved members.

    Args:
        plan: The plan.
        sweep: The sweep.
        unlimited: Whether the proofs have no budget of time.

    Raises:
        StoreError: A proof cannot be written.
    """
    reasons = {variant: undecided_reason(plan, variant) for variant in plan.variants}
    decided = [variant for variant, reason in reasons.items() if reason is None]
    if not decided:
        why = "; ".join(dict.fromkeys(filter(None, reasons.values())))
        return Answers([f"not proved; {why}"], {"bodies": 0, "reached": 0, "why": why})
    if all(shares_proof(plan, variant) for variant in decided):
        return _of_shared(plan, sweep, unlimited=unlimited)
    return _of_bodies(plan, sweep, unlimited=unlimited)


def _of_shared(plan: Plan, sweep: Sweep, *, unlimited: bool) -> Answers:
    """Prove the rest states that the members of each variant share."""
    results = sweep.folder.path.parent
    bodies = sum(shares_proof(plan, variant) for variant in plan.variants)
    data: dict[str, Any] = {"bodies": bodies, "reached": bodies}
    with working("proofs of rest states"):
        try:
            keep_proofs(plan, results, brief=not unlimited)
        except KeyboardInterrupt:
            # An interrupt ends the proofs at once. Each finished one is stored.
            missing = counted(bodies, "proof of rest states", "proofs of rest states")
            return Answers([], {"bodies": bodies, "reached": None, "interrupted": True}, missing)
        if plan.members > MAX_COUNTED:
            return Answers(["rbstab report shows for which members it is proved"], data)
        proofs = ProvedConvergence(plan, results)
        convergence = store_convergence(plan, sweep, proofs)
    counts = Counter(convergence.codes.tolist())
    return Answers(_sentences(counts) + _ended_early(proofs.brief), data | _data(counts, 0))


def _of_bodies(plan: Plan, sweep: Sweep, *, unlimited: bool) -> Answers:
    """Prove the rest states of each distinct body, within a budget."""
    budget, bodies = None if unlimited else prove_bodies.BUDGET, bodies_of(plan)
    limit = "without a limit of time"
    if budget is not None:
        limit = f"for at most {budget:g} s; those begun by then are finished"
    hint(f"Proving the rest states of {_bodies(len(bodies))}, {limit} ...")
    stop = Event()
    with (
        # The first interrupt ends the proofs, and stores what was proved until then. The second one
        # ends the command at once.
        graceful_interrupts(stop, stop),
        working("proofs of rest states") as work,
    ):
        proofs = prove_members(
            *(plan, sweep),
            bodies=bodies,
            budget=budget,
            processes=processors.processor_count(),
            progress=work.count,
            stop=stop,
        )
    left = np.flatnonzero(~proofs.reached & (proofs.convergence.codes == NO_PROOF))
    # Those that were not reached in time are told apart.
    counts = Counter(proofs.convergence.codes.tolist()) - Counter({NO_PROOF: len(left)})
    ranges = ranges_of(left.tolist())
    data = {
        "bodies": proofs.bodies,
        "reached": proofs.reached_bodies,
        "budget": proofs.budget,
        "seconds": round(proofs.seconds, 3),
        **_data(counts, len(left)),
        "members_not_reached": ranges,
        "one_rest_state": proofs.sole_state.data,
        "boxes": [
            {
                "variant": proof.variant,
                "members": ranges_of(proof.members.tolist()),
                "proved": proof.record.proved,
                "level": proof.record.level,
            }
            for proof in proofs.boxes
        ],
    }
    sentences = [
        *(f"{text[:1].lower()}{text[1:]}" for text in proofs.sole_state.sentences),
        *_of_boxes(plan, proofs),
        *_sentences(counts),
        *_ended_early(proofs.brief),
    ]
    every, which = _bodies(proofs.bodies), named_members(ranges)
    if stop.is_set() and len(left):
        missing = f"{grouped(proofs.bodies - proofs.reached_bodies)} of {every}"
        ended = data | {"interrupted": True}
        return Answers(sentences, ended, f"the proofs of {missing}: those of {which}")
    if len(left):
        limit = "the proofs" if budget is None else f"the budget of {proofs.budget:g} s"
        sentences.append(
            f"not proved for {grouped(len(left))} of the members: {limit} reached "
            f"{grouped(proofs.reached_bodies)} of {every}, and not those of {which}. Run the same "
            "command again to go on; with --prove it goes on to the last body"
        )
    elif budget is not None:
        took = f"{proofs.seconds:.2g} s of at most {budget:g} s"
        sentences.append(f"the proofs of {every} took {took}")
    return Answers(sentences, data)


def _bodies(count: int) -> str:
    return counted(count, "distinct body", "distinct bodies")


def _of_boxes(plan: Plan, proofs: BodyProofs) -> list[str]:
    """Return sentences on the proofs for many bodies at once; none if nothing is proved."""
    sentences = []
    for variant in plan.variants:
        variant_proofs = [proof for proof in proofs.boxes if proof.variant == variant]
        named = f" of variant {variant}" if len(plan.variants) > 1 else ""
        between = f"{named} between the least and the greatest value of each number of the plan"
        for proof in variant_proofs:
            if proof.whole and proof.record.proved:
                texts = sentences_of(f"for every body{between}", proof.record)
                sentences += [text.removesuffix(".") for text in texts]
        parts = [proof for proof in variant_proofs if not proof.whole]
        if parts:
            members = sum(len(proof.members) for proof in parts)
            levels = sorted((rounded_down(proof.record.level) for proof in parts), key=float)
            ends = " to ".join(f"{level} J" for level in dict.fromkeys((levels[0], levels[-1])))
            sentences.append(
                f"for the bodies of {grouped(members)} members{named}: one rest state, a minimum, "
                f"proved in {counted(len(parts), 'box', 'boxes')} of bodies. Every motion with "
                f"v(0) below the level of its box converges ({ends})"
            )
    return sentences


def _ended_early(count: int) -> list[str]:
    """Return a sentence on brief proofs that may prove more with more boxes, if any."""
    if not count:
        return []
    need = "one proof needs" if count == 1 else f"{grouped(count)} proofs need"
    return [f"{need} more boxes for the rest states; --prove tries more"]


def _data(counts: Counts, not_reached: int) -> dict[str, Any]:
    """Return the numbers of members as data, by words; those that were not reached in time last."""
    words = {word: counts[code] for code, word in enumerate(CONVERGENCE) if counts[code]}
    return {"members": words | ({"not reached": not_reached} if not_reached else {})}


def _sentences(counts: Counts) -> list[str]:
    """Return a sentence for each answer: for how many members, and why."""
    return [text.format(grouped(counts[code])) for code, text in SENTENCES.items() if counts[code]]
