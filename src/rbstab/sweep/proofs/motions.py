"""Prove the convergence of members by enclosing their exact motions, together if possible."""

from collections.abc import Mapping
from contextlib import suppress
from threading import Lock
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from rbstab.config.build import problem_of
from rbstab.experiment.convergence.convergence import Convergence, Undecided
from rbstab.experiment.convergence.decisions import nothing_proved, refusal
from rbstab.experiment.convergence.exact_motion import prove_convergence
from rbstab.experiment.convergence.many_motions import Motions
from rbstab.experiment.proof import prove
from rbstab.experiment.stored_proof.proof import Proof, no_proof
from rbstab.mechanics.numbers import Array
from rbstab.sweep.plan.plan import Plan
from rbstab.sweep.plan.proof_selection import ProofSelection
from rbstab.sweep.proofs.columns import MOTION_COLUMNS, MOTION_PROOFS
from rbstab.sweep.proofs.starts import ProvedStarts
from rbstab.sweep.proofs.variants import rows_of_variants, shares_proof

_PROVERS: "WeakKeyDictionary[Plan, MotionProver]" = WeakKeyDictionary()
"""The prover of each plan. It has the proofs of the rest states, which take up to some seconds."""

_LOCK = Lock()
"""Held while a member is proved: the precision of balls is a setting of the whole process, and a
process may have several threads that compute members."""


class _Shared(NamedTuple):
    """What the members of a variant share: the proof of their rest states, and the proved starts.

    starts is None if no member of the variant can be proved at its start. many encloses their
    motions; it is None if that is refused.
    """

    proof: Proof
    starts: ProvedStarts | None
    many: Motions | None


def motion_columns(plan: Plan, start: int, stop: int) -> dict[str, Array]:
    """Return `MOTION_COLUMNS` of the members from number `start` up to `stop`.

    Args:
        plan: The plan. Without `prove` there are no such columns.
        start: The first member.
        stop: One after the last member, as in `range`.
    """
    if plan.prove is None:
        return {}
    with _LOCK:
        if plan not in _PROVERS:
            _PROVERS[plan] = MotionProver(plan, plan.prove)
        prover = _PROVERS[plan]
    return prover.columns(start, stop)


class MotionProver:
    """Proves the convergence of members: at their starts, and by enclosures of their motions.

    Where only the initial state varies, one proof of rest states, made at the first use, serves all
    members of a variant. Elsewhere each member needs its own. What is found depends on the plan
    alone.

    Args:
        plan: The plan.
        selection: The members, and the limit of steps.
    """

    def __init__(self, plan: Plan, selection: ProofSelection) -> None:
        self.plan = plan
        self.selection = selection
        self._shared: dict[str, _Shared | None] = {}

    def columns(self, start: int, stop: int) -> dict[str, Array]:
        """Return `MOTION_COLUMNS` of the members from number `start` up to `stop`."""
        members = stop - start
        columns = {
            name: np.zeros(members, dtype=column.dtype) for name, column in MOTION_COLUMNS.items()
        }
        columns["proved_time"][:] = np.nan
        selected = self.selection.selected(start, stop, self.plan.members)
        for variant, rows, own in rows_of_variants(self.plan, self.plan.variants, start, stop):
            if not len(rows):
                continue
            with _LOCK:
                shared = self._shared_by(variant)
                if shared is not None and shared.starts is not None:
                    numbers = shared.starts.find(own, len(rows))
                    columns["proved_rest_state"][rows] = numbers
                    columns["proved_time"][rows[numbers > 0]] = 0.0
            enclosed = selected[rows] & (columns["proved_rest_state"][rows] == 0)
            some = {key: entries[enclosed] for key, entries in own.items()}
            if not self._enclosed_together(columns, shared, some, rows[enclosed]):
                for row in rows[enclosed].tolist():
                    with _LOCK:
                        self._enclose(columns, variant, start, row)
        return columns

    def _enclosed_together(
        self,
        columns: dict[str, Array],
        shared: _Shared | None,
        values: Mapping[str, Array],
        rows: Array,
    ) -> bool:
        """Enclose the motions of members of one system together; return whether that was done."""
        if not len(rows) or shared is None or shared.starts is None or shared.many is None:
            return False
        with suppress(Exception):  # then each member is enclosed by itself
            centre, error = shared.starts.states(values, len(rows))
            with _LOCK:
                found = shared.many.follow_all(centre, error, self.selection.steps)
            for row, one in zip(rows.tolist(), found, strict=True):
                ended = Undecided.NO_STEP if one.lost else Undecided.STEP_LIMIT
                if isinstance(one.decision, Convergence):
                    _fill(columns, row, "proved", one.steps, one.decision.rest_state, one.time)
                else:
                    _fill(columns, row, str(one.decision or ended), one.steps)
            return True
        return False

    def _enclose(self, columns: dict[str, Array], variant: str, start: int, row: int) -> None:
        """Enclose the motion of one member, and fill in what is proved of it."""
        # An error in one member must not stop the others; it is not decided.
        try:
            found = self._convergence(variant, start + row)
            if found.proved:
                _fill(columns, row, "proved", found.steps, found.rest_state, found.time)
            else:
                undecided = str(found.reason or Undecided.NO_REGION)
                _fill(columns, row, "false" if found.proved is False else undecided, found.steps)
        except Exception:
            _fill(columns, row, "failed", 0)

    def _convergence(self, variant: str, member: int) -> Convergence:
        config = self.plan.config_of(member)
        problem = problem_of(config)
        refused = nothing_proved(problem)
        if refused is not None:
            # It needs no proof of rest states.
            return refused
        shared = self._shared_by(variant)
        proof = shared.proof if shared is not None else prove(config, problem)
        steps = self.selection.steps
        return prove_convergence(config, problem, proof, max_steps=steps).convergence

    def _shared_by(self, variant: str) -> _Shared | None:
        """Return what the members of a variant share; None if each needs its own proof."""
        if variant not in self._shared:
            self._shared[variant] = (
                self._made(variant) if shares_proof(self.plan, variant) else None
            )
        return self._shared[variant]

    def _made(self, variant: str) -> _Shared:
        base, keys = self.plan.base_of(variant), self.plan.varied_keys_of(variant)
        try:
            proof = prove(base, self.plan.initial_value_problems[variant])
        except Exception as error:
            # The members can be integrated all the same; none of them is decided.
            proof = no_proof("", f"{type(error).__name__}: {error}")
        if not proof.states:
            return _Shared(proof, None, None)
        refused = refusal(self.plan.initial_value_problems[variant], proof)
        many = None
        if refused is None:
            with suppress(Exception):  # then each member is enclosed by itself
                many = Motions(base, proof)
        return _Shared(proof, ProvedStarts(base, keys, proof), many)


def _fill(  # noqa: PLR0913, PLR0917 (the columns)
    columns: dict[str, Array],
    row: int,
    word: str,
    steps: int,
    rest_state: int | None = 0,
    time: float | None = np.nan,
) -> None:
    """Fill in how the enclosure of a member ended, in a word of `MOTION_PROOFS`."""
    columns["motion_proof"][row] = MOTION_PROOFS.index(word)
    columns["proof_steps"][row] = steps
    columns["proved_rest_state"][row] = rest_state
    columns["proved_time"][row] = time
