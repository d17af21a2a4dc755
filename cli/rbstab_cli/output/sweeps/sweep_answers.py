"""What is proved of the members of a sweep, proved after its results are stored, and printed."""

from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from rbstab.sweep.plan.plan import Plan

MAX_COUNTED = 100_000
"""Members of a sweep are counted up to this number; each takes up to a tenth of a millisecond."""

OWN_BODIES = (
    "its members do not share one body, gravity and gains; rbstab stability CONFIG --within "
    "proves what holds for all bodies within tolerances"
)
"""Why nothing is proved unasked of a sweep whose members need a proof each."""


def prove_members(plan: "Plan", results: Path, *, quiet: bool) -> None:
    """Prove the rest states that members share, and print how many members start in a region.

    Args:
        plan: The plan.
        results: The folder of results, which has the proofs.
        quiet: Whether to leave out progress.

    Raises:
        StoreError: A proof cannot be written.
    """
    from rbstab.sweep.proofs.convergence import keep_proofs, shares_proof, undecided_reason
    from rbstab_cli.output.progress import working

    if not any(shares_proof(plan, variant) for variant in plan.variants):
        reasons = [undecided_reason(plan, variant) for variant in plan.variants]
        why = OWN_BODIES if None in reasons else "; ".join(dict.fromkeys(filter(None, reasons)))
        click.echo(f"Convergence: not proved; {why}.")
        return
    with working("proofs of rest states", wanted=not quiet):
        keep_proofs(plan, results)
        words = _counted(plan, results)
    for line in words:
        click.echo(f"Convergence: {line}.")


def _counted(plan: "Plan", results: Path) -> list[str]:
    """Return sentences on how many members are proved to converge from their start."""
    from rbstab.sweep.proofs.columns import FALSE, NO_PROOF, NOT_PROVED, PROVED
    from rbstab.sweep.proofs.convergence import ProvedConvergence

    if plan.members > MAX_COUNTED:
        return ["rbstab report shows for which members it is proved"]
    codes = ProvedConvergence(plan, results).of(0, plan.members).codes
    counts = Counter(codes.tolist())
    sentences = {
        PROVED: "proved for {} of the members: they start in a certified region",
        FALSE: "proved to be false for {} of the members: there is no rest state",
        NOT_PROVED: "not proved for {} of the members: they start outside of every certified "
        "region; the key prove of a plan encloses their motions",
        NO_PROOF: "not proved for {} of the members: no proof covers them",
    }
    return [text.format(counts[code]) for code, text in sentences.items() if counts[code]]
