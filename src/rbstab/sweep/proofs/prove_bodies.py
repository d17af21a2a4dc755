"""Prove the rest states of the distinct bodies of a plan, within a budget of time.

Each proof is kept in the folder of results. What the budget does not reach is not proved; a second
call goes on after the members that were decided before.
"""

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from threading import Event
from time import monotonic
from typing import NamedTuple

import numpy as np

from rbstab.config.schema import Config
from rbstab.experiment.proof_cache import cached_proof, proof_for
from rbstab.experiment.stored_proof.proof import Proof
from rbstab.mechanics.numbers import Array
from rbstab.processes.workers import worked
from rbstab.sweep.plan.plan import Plan
from rbstab.sweep.proofs.bodies import Bodies, bodies_of, values_at_start
from rbstab.sweep.proofs.boxes import BoxProof
from rbstab.sweep.proofs.columns import NO_PROOF
from rbstab.sweep.proofs.convergence import (
    MemberConvergence,
    of_body,
)
from rbstab.sweep.proofs.sole_state import SoleState
from rbstab.sweep.proofs.starts import ProvedStarts

BUDGET = 10.0
"""The time for the proofs of all bodies of a sweep, s, if nobody asks for more."""

ALONE = 2
"""Up to this many bodies are proved in this process: workers take a second to start."""

FEW = 64
"""Of more bodies than this, the budget does not reach all: so many are proved at once (`boxes`)."""

Progress = Callable[[int, int], None]
"""Called with the number of bodies that were reached, and of all."""


class BodyProofs(NamedTuple):
    """What was proved of the members of a plan.

    Attributes:
        convergence: The convergence of each member.
        reached: Whether the body of each member was reached in time, shape (members,).
        bodies: The number of distinct bodies.
        reached_bodies: How many of them were reached.
        budget: The budget, s; None: no limit.
        seconds: The time that was taken, s.
        brief: How many proofs ended early because nobody asked for them (`proof_for`).
        boxes: The proofs for many bodies at once.
        sole_state: Which bodies have one rest state, by any proof.
    """

    convergence: MemberConvergence
    reached: Array
    bodies: int
    reached_bodies: int
    budget: float | None
    seconds: float
    brief: int = 0
    boxes: Sequence[BoxProof] = ()
    sole_state: SoleState = SoleState()


def prove_bodies(  # noqa: PLR0913 (options by name)
    plan: Plan,
    results: Path,
    stored: MemberConvergence,
    *,
    bodies: Bodies | None = None,
    budget: float | None = BUDGET,
    processes: int = 1,
    progress: Progress = lambda _reached, _all: None,
    stop: Event | None = None,
) -> BodyProofs:
    """Prove the rest states of each distinct body, and find the members that start in a region.

    The bodies are reached in an order that is spread over the plan, so that a part of them shows
    all of it thinly. No new one is begun when the budget is used up. An interrupt ends the running
    proofs too, but for one in this process; all finished ones are kept.

    Args:
        plan: The plan.
        results: The folder of results, which keeps the proofs.
        stored: What is known of the members. Bodies of whose members all are known are not proved
            again.
        bodies: The bodies of the plan, if they are known (`bodies_of`).
        budget: The time, s; None: no limit.
        processes: The largest number of worker processes.
        progress: Called after each body.
        stop: Set by an interrupt; None: it cannot be interrupted.

    Raises:
        StoreError: A proof cannot be written.
    """
    begin = monotonic()
    bodies = bodies_of(plan) if bodies is None else bodies
    decided = np.ones(len(bodies), dtype=bool)
    decidable = bodies.of_member >= 0
    decided[bodies.of_member[decidable & (stored.codes == NO_PROOF)]] = False
    waiting = bodies.order[~decided[bodies.order]].tolist()
    reached, answers = decided.copy(), stored.copy()
    count, ended_early = int(decided.sum()), 0
    progress(count, len(bodies))
    end = math.inf if budget is None else begin + budget
    interrupt = stop or Event()
    proofs = worked(
        # Nobody asked for more than the budget: one proof must not use it up.
        partial(_prove, results, budget is not None),
        waiting,
        lambda body: plan.config_of(int(bodies.first[body])),
        workers=min(processes, len(waiting)) if len(waiting) > ALONE else 1,
        may_begin=lambda: not interrupt.is_set() and monotonic() < end,
        is_given_up=interrupt.is_set,
    )
    for body, _ in proofs:
        proof = cached_proof(results, plan.config_of(int(bodies.first[body])))
        if proof is not None:
            _add(plan, bodies.members(body), proof, answers)
            ended_early += proof.goes_on
        reached[body] = True
        count += 1
        progress(count, len(bodies))
    of_member = np.ones(plan.members, dtype=bool)
    of_member[decidable] = reached[bodies.of_member[decidable]]
    seconds = monotonic() - begin
    return BodyProofs(answers, of_member, len(bodies), count, budget, seconds, ended_early)


def _add(plan: Plan, members: Array, proof: Proof, answers: MemberConvergence) -> None:
    """Add what the proof of a body says of the members that have it."""
    keys, values = values_at_start(plan, members)
    starts = ProvedStarts(plan.config_of(int(members[0])), keys, proof)
    problem = next(iter(plan.initial_value_problems.values()))
    convergence = of_body(starts, values, len(members), at_poles=problem.quaternion)
    # What is stored may be more: a proof for all bodies within tolerances.
    merged = convergence.beside(MemberConvergence(*(column[members] for column in answers)))
    for column, entries in zip(answers, merged, strict=True):
        column[members] = entries


def _prove(results: Path, brief: bool, config: Config) -> None:
    """Make the proof of a config and keep it; without a proof, its members are not decided."""
    with suppress(ArithmeticError, ValueError, LookupError, TypeError):
        proof_for(results, config, brief=brief)
