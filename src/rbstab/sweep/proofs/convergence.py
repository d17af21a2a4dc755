"""Find the members that start in a region where convergence is proved."""

from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rbstab.experiment.proof_cache import cached_proof, proof_for
from rbstab.experiment.stored_proof.proof import Proof
from rbstab.experiment.stored_proof.starts import has_no_rest_state
from rbstab.mechanics.numbers import Array
from rbstab.store.table import Table
from rbstab.sweep.plan.plan import Plan
from rbstab.sweep.proofs.columns import (
    CONVERGENCE_COLUMNS,
    FALSE,
    FIRST_UNDECIDED,
    MOTION_PROOFS,
    NO_PROOF,
    NOT_DECIDED,
    NOT_PROVED,
    NOT_SOLE_STATE,
    PROVED,
    SOLE_STATE,
    STATES_UNDECIDED,
)
from rbstab.sweep.proofs.robust import START_COLUMNS, BoxProofs
from rbstab.sweep.proofs.starts import ProvedStarts
from rbstab.sweep.proofs.variants import rows_of_variants, shares_proof, undecided_reason


class MemberConvergence(NamedTuple):
    """What is proved of m members.

    Attributes:
        codes: The code of each member in `CONVERGENCE`, shape (m,).
        rest_states: The number of the rest state, from 1 for the lowest; 0: not proved; shape (m,).
        sole_state: Whether its body has one rest state in the range, a minimum, by a proof of its
            own: the code in `SOLE_STATE_WORDS`, shape (m,).
    """

    codes: Array
    rest_states: Array
    sole_state: Array

    def beside(self, stored: "MemberConvergence") -> "MemberConvergence":
        """Return this with what is stored of members of which it says nothing, or less."""
        keep = (self.codes == NO_PROOF) | ((self.codes != PROVED) & (stored.codes >= PROVED))
        return MemberConvergence(
            np.where(keep, stored.codes, self.codes),
            np.where(keep, stored.rest_states, self.rest_states),
            np.where(self.sole_state == STATES_UNDECIDED, stored.sole_state, self.sole_state),
        )

    def copy(self) -> "MemberConvergence":
        """Return a copy whose arrays can be changed."""
        return MemberConvergence(*(column.copy() for column in self))

    @classmethod
    def nothing(cls, count: int) -> "MemberConvergence":
        """Return that nothing is proved of some members."""
        return cls(
            np.full(count, NO_PROOF, dtype=np.int8),
            np.zeros(count, dtype=np.int32),
            np.full(count, STATES_UNDECIDED, dtype=np.int8),
        )


class ProvedConvergence:
    """The proved convergence of members from their starts, by cached proofs.

    Members of a variant share a proof if the plan varies only their initial state. Members of
    other variants are "unknown", unless a proof for all bodies within tolerances covers them. So
    are sliding members.

    Args:
        plan: The plan.
        results: The folder of results, which contains the cached proofs.

    Attributes:
        boxes: The proofs for many bodies at once, of variants of several bodies.
        bounds: By variant, the energy below which members converge to the lowest rest state, J, if
            that is proved. It is the sum of all energies at the start.
    """

    def __init__(self, plan: Plan, results: Path) -> None:
        self.plan = plan
        shared = [variant for variant in plan.variants if shares_proof(plan, variant)]
        cached = {variant: cached_proof(results, plan.base_of(variant)) for variant in shared}
        self._proofs = {v: p for v, p in cached.items() if p is not None}
        self._starts = {
            variant: ProvedStarts(plan.base_of(variant), plan.varied_keys_of(variant), proof)
            for variant, proof in self._proofs.items()
        }
        several = [v for v in plan.variants if v not in shared and not undecided_reason(plan, v)]
        self.boxes = BoxProofs(plan, several, results)
        self.bounds = {
            variant: proof.region.lower_bound + proof.states[0].energy
            for variant, proof in self._proofs.items()
            if proof.region is not None
        }

    @property
    def brief(self) -> int:
        """The number of proofs that ended early, and may prove more with more boxes."""
        return sum(proof.goes_on for proof in self._proofs.values())

    def of(self, start: int, stop: int) -> MemberConvergence:
        """Return what is proved of the members from number `start` up to `stop`."""
        convergence = MemberConvergence.nothing(stop - start)
        for variant, rows, values in rows_of_variants(self.plan, self._proofs, start, stop):
            problem = self.plan.initial_value_problems[variant]
            starts, count = self._starts[variant], len(rows)
            new = of_body(starts, values, count, at_poles=problem.quaternion)
            for column, entries in zip(convergence, new, strict=True):
                column[rows] = entries
        return convergence

    def within(
        self, start: int, stop: int, table: Table, convergence: MemberConvergence
    ) -> MemberConvergence:
        """Return what is proved of members, with what proofs for all bodies in a box say.

        Args:
            start: The first member.
            stop: One after the last member, as in `range`.
            table: Their table, with `START_COLUMNS`.
            convergence: What is proved of them otherwise.
        """
        more, proved = convergence.copy(), self.boxes.proved(start, stop, table)
        more.rest_states[proved & (more.codes != PROVED)] = 1
        more.codes[proved] = PROVED
        return more


def of_body(
    starts: ProvedStarts, values: Mapping[str, Array], count: int, *, at_poles: bool
) -> MemberConvergence:
    """Return what the proof of one body says of members that differ in their initial state.

    Args:
        starts: The starts from which it proves convergence.
        values: The values of the varied keys of the initial state, each of shape (count,).
        count: The number of members.
        at_poles: Whether the motions may pass the poles of the Euler angles.
    """
    proof, convergence = starts.proof, MemberConvergence.nothing(count)
    convergence.sole_state[:] = sole_state_code(proof)
    if has_no_rest_state(proof, at_poles=at_poles):
        convergence.codes[:] = FALSE
    elif proof.states or has_no_rest_state(proof):
        convergence.rest_states[:] = starts.find(values, count)
        # After a brief proof that may find more, that a member is in no region is not known.
        convergence.codes[:] = NO_PROOF if proof.goes_on else NOT_PROVED
        convergence.codes[convergence.rest_states > 0] = PROVED
    return convergence


def proved_columns(starts: MemberConvergence, shard: Table) -> dict[str, Array]:
    """Return `CONVERGENCE_COLUMNS` of a shard, and its own `proved_time` if it has that column.

    Args:
        starts: What is proved of the starts of its members.
        shard: The shard, with `MOTION_COLUMNS` if the plan has `prove`.
    """
    codes, rest_states, sole_state = starts.copy()
    columns = {"proved_rest_state": rest_states, "one_rest_state": sole_state}
    if "motion_proof" not in shard:
        return {"convergence": codes, **columns}
    inside = rest_states > 0
    rest_states = np.where(inside, rest_states, shard["proved_rest_state"])
    codes[rest_states > 0] = PROVED
    ended = shard["motion_proof"]
    codes[~inside & (ended >= FIRST_UNDECIDED)] = NOT_DECIDED
    codes[~inside & (ended == MOTION_PROOFS.index("false"))] = FALSE
    return {
        "convergence": codes,
        **columns,
        "proved_rest_state": rest_states,
        "proved_time": np.where(inside, 0.0, shard["proved_time"]),
    }


def keep_proofs(plan: Plan, results: Path, *, brief: bool = False) -> None:
    """Make the proofs of rest states that members share, and keep them in the results folder.

    Args:
        plan: The plan.
        results: The folder of results.
        brief: Whether brief proofs will do, as in `proof_for`.

    Raises:
        StoreError: A proof cannot be written.
    """
    for variant in plan.variants:
        if not shares_proof(plan, variant):
            continue
        # Only the disk may stop the sweep: without a proof the members are not decided.
        with suppress(ArithmeticError, ValueError, LookupError, TypeError):
            problem = plan.initial_value_problems[variant]
            proof_for(results, plan.base_of(variant), problem, brief=brief)


def sole_state_code(proof: Proof) -> int:
    """Return whether a body has one rest state in the range, a minimum, by its own proof.

    Where a spring has no length, a tied body may have one more, of which the proof says nothing.
    """
    if sum(state.proved for state in proof.states) > 1:
        return NOT_SOLE_STATE
    if proof.needs_lengths:
        return STATES_UNDECIDED
    if proof.globally_stable:
        return SOLE_STATE
    none = proof.proved and not proof.states
    no_minimum = proof.unique and proof.globally_stable is False
    return NOT_SOLE_STATE if none or no_minimum else STATES_UNDECIDED


PROOF_COLUMNS = (*CONVERGENCE_COLUMNS, *START_COLUMNS)
"""The columns of a sweep from which it follows what is proved of its members now."""


def stored_convergence(table: Table) -> MemberConvergence:
    """Return what the columns of a table say, without later proofs."""
    return MemberConvergence(*(table[name] for name in CONVERGENCE_COLUMNS))


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
    return proofs.within(0, members, table, proofs.of(0, members).beside(stored))
