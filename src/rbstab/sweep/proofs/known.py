"""What is proved of the members of a finished sweep, with the proofs that lie beside it now."""

import numpy as np

from rbstab.config.source import key_of
from rbstab.experiment.proof import CODE_NOT_RUN
from rbstab.mechanics.numbers import Array
from rbstab.store.table import Table
from rbstab.sweep.plan.axes import VARIANT
from rbstab.sweep.plan.plan import Plan
from rbstab.sweep.proofs.columns import KNOWN_COLUMNS, NO_PROOF
from rbstab.sweep.proofs.convergence import MemberConvergence, ProvedConvergence, undecided_reason
from rbstab.sweep.proofs.robust import START_COLUMNS

PROOF_COLUMNS = (*KNOWN_COLUMNS, *START_COLUMNS)
"""The columns to read of a sweep."""


def without_theorem(plan: Plan) -> dict[str, Array]:
    """Return the members that no theorem covers: a mask of shape (members,) by the reason.

    Code of a user that may not run here is no such reason: the sweep that made the proofs ran it.
    """
    found: dict[str, Array] = {}
    for variant in plan.variants:
        reason = undecided_reason(plan, variant)
        if reason not in (None, CODE_NOT_RUN):
            own = members_of_variant(plan, variant)
            found[reason] = found.get(reason, np.zeros(plan.members, bool)) | own
    return found


def members_of_variant(plan: Plan, variant: str) -> Array:
    """Return which members have a variant, shape (members,)."""
    variants = plan.values(0, plan.members, [key_of(VARIANT)]).get(key_of(VARIANT))
    return np.ones(plan.members, bool) if variants is None else np.asarray(variants == variant)


def stored_convergence(table: Table) -> MemberConvergence:
    """Return what the columns of a table say, without later proofs."""
    return MemberConvergence(*(table[name] for name in KNOWN_COLUMNS))


def convergence_now(table: Table, proofs: ProvedConvergence | None) -> MemberConvergence:
    """Return what is proved of the members: what is stored, and more by proofs made since.

    Args:
        table: The table of the sweep, with `PROOF_COLUMNS`.
        proofs: The proofs in the folder of results; None if the plan cannot be read.
    """
    stored = stored_convergence(table)
    # Members without a proof may have one now: variants have proofs of their own.
    if proofs is None or not (stored.codes == NO_PROOF).any():
        return stored
    members = len(stored.codes)
    found = proofs.of(0, members).beside(stored)
    return proofs.within(0, members, table, found)
