"""Prove the convergence of members by enclosing their exact motions, those of one body together."""

from collections.abc import Callable, Mapping
from functools import partial
from threading import Lock
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from rbstab.config.build import problem_of
from rbstab.config.schema import Config
from rbstab.experiment.convergence.convergence import Convergence, Undecided
from rbstab.experiment.convergence.decisions import nothing_proved, refusal
from rbstab.experiment.convergence.many_motions import Motions
from rbstab.experiment.proof import prove
from rbstab.mechanics.numbers import Array
from rbstab.sweep.plan.axes import VariedKey
from rbstab.sweep.plan.plan import Plan
from rbstab.sweep.plan.proof_selection import ProofSelection
from rbstab.sweep.proofs.columns import MOTION_COLUMNS, MOTION_PROOFS
from rbstab.sweep.proofs.starts import ProvedStarts
from rbstab.sweep.proofs.variants import rows_of_variants, shares_proof

_PROVERS: "WeakKeyDictionary[Plan, MotionProver]" = WeakKeyDictionary()
"""The prover of each plan. It has the proofs of the rest states, which take up to some seconds."""

_LOCK = Lock()
"""Held while members are proved: the precision of balls is a setting of the whole process, and a
process may have several threads that compute members."""

FAILED = "failed"
"""The word of `MOTION_PROOFS` of members for which an error was raised."""


class _Body(NamedTuple):
    """What members with one body share."""

    # The starts that are proved; None if there are none.
    starts: ProvedStarts | None
    # Encloses their motions; None if none can be enclosed, for the reason `why`, a word of
    # `MOTION_PROOFS`.
    many: Motions | None
    why: str = ""


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
        return _PROVERS[plan].columns(start, stop)


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
        self._shared: dict[str, _Body] = {}

    def columns(self, start: int, stop: int) -> dict[str, Array]:
        """Return `MOTION_COLUMNS` of the members from number `start` up to `stop`."""
        plan = self.plan
        columns = {
            name: np.zeros(stop - start, dtype=column.dtype)
            for name, column in MOTION_COLUMNS.items()
        }
        columns["proved_time"][:] = np.nan
        selected = self.selection.selected(start, stop, plan.members)
        for variant, rows, values in rows_of_variants(plan, plan.variants, start, stop):
            if not shares_proof(plan, variant):
                for row in np.flatnonzero(selected[rows]):
                    body = _body_of(partial(plan.config_of, start + int(rows[row])), ())
                    self._fill(columns, body, {}, rows[[row]], selected)
            elif len(rows):
                if variant not in self._shared:
                    keys = plan.varied_keys_of(variant)
                    self._shared[variant] = _body_of(partial(plan.base_of, variant), keys)
                self._fill(columns, self._shared[variant], values, rows, selected)
        return columns

    def _fill(
        self,
        columns: dict[str, Array],
        body: _Body,
        values: Mapping[str, Array],
        rows: Array,
        selected: Array,
    ) -> None:
        """Fill in what is proved of the members of a body, which are at some rows."""
        if body.starts is not None:
            numbers = body.starts.find(values, len(rows))
            columns["proved_rest_state"][rows] = numbers
            columns["proved_time"][rows[numbers > 0]] = 0.0
        enclosed = selected[rows] & (columns["proved_rest_state"][rows] == 0)
        rows = rows[enclosed]
        columns["motion_proof"][rows] = MOTION_PROOFS.index(body.why or FAILED)
        if body.starts is None or body.many is None or not len(rows):
            return
        some = {key: entries[enclosed] for key, entries in values.items()}
        try:
            centre, error = body.starts.states(some, len(rows))
            motions = body.many.follow_all(centre, error, self.selection.steps)
        except Exception:  # an error must not stop the sweep: these members are not decided
            return
        for row, motion in zip(rows, motions, strict=True):
            word = str(
                motion.decision or (Undecided.NO_STEP if motion.lost else Undecided.STEP_LIMIT)
            )
            if isinstance(motion.decision, Convergence):
                word = "proved"
                columns["proved_rest_state"][row] = motion.decision.rest_state
                columns["proved_time"][row] = motion.time
            columns["motion_proof"][row] = MOTION_PROOFS.index(word)
            columns["proof_steps"][row] = motion.steps


def _body_of(made: Callable[[], Config], keys: tuple[VariedKey, ...]) -> _Body:
    """Return what members share whose configs differ in the values of some keys of their starts."""
    try:
        config = made()
        problem = problem_of(config)
        refused = nothing_proved(problem)
        if refused is not None:
            return _Body(None, None, str(refused.reason))  # it needs no proof of rest states
        proof = prove(config, problem)
        starts = ProvedStarts(config, keys, proof) if proof.states else None
        refused = refusal(problem, proof)
        if refused is None:
            return _Body(starts, Motions(config, proof))
        return _Body(starts, None, "false" if refused.proved is False else str(refused.reason))
    except Exception:  # the members can be integrated all the same; none of them is decided
        return _Body(None, None, FAILED)
