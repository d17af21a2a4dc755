"""A barrier of θ2 with which every start in the range is proved to converge."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from rbstab.config.schema import Config
from rbstab.experiment.answers.state_words import kinds_of
from rbstab.experiment.proof import prove
from rbstab.experiment.simulate import simulate
from rbstab.experiment.stored_proof.proof import Proof
from rbstab.experiment.tuning.guarded_run import (
    RunOutcome,
    check_single,
    guard_name,
    guards_of,
    outcome_of,
    with_guard,
)
from rbstab.experiment.tuning.sensitivities import UnsuitedConfigError
from rbstab.integrate.status import RunStatus
from rbstab.store.result import Result

ANY_ANGLES = "with |θ2| < π/2 and any θ1, θ3"
"""Where a barrier must leave a single rest state: it keeps θ2, and neither θ1 nor θ3."""

BARRIER = ("barrier",)
"""The method of the guard that is found, and of one that it replaces."""

LADDER = tuple(float(f"{digit}e{power}") for power in range(-2, 5) for digit in (1, 2, 5))
"""N m: the stiffnesses that are tried, ascending, until one is enough."""

REFINEMENTS = 4
"""How often the gap below the first stiffness that is enough is halved, in logarithms."""


class Guarded(NamedTuple):
    """A config with a barrier, and what the barrier changes in its run.

    Attributes:
        config: The config with the barrier; None if no stiffness was enough.
        stiffness: Its stiffness, N m; None likewise.
        tried: Each stiffness that was tried, with what came of it.
        given: The run of the given config.
        guarded: The run of the config with the barrier; None likewise.
    """

    config: Config | None
    stiffness: float | None
    tried: tuple[tuple[float, str], ...]
    given: RunOutcome
    guarded: RunOutcome | None


def guard(config: Config, on_tried: Callable[[float, str], None] = lambda *_: None) -> Guarded:
    """Find a stiffness of a barrier with which every start is proved to converge.

    More stiffness is not always better: a barrier can bring rest states of its own. So the
    stiffnesses of `LADDER` are tried one after the other, and then some between the last one that
    is not enough and the first one that is. A smaller one outside these may do too.

    The exact motion then never leaves the range. A run stops at cos θ2 = `range_bound` though,
    where the barrier stores a finite energy. So the run must stay in the range as well.

    Args:
        config: The config; a barrier in it is replaced.
        on_tried: Called with each stiffness, N m, and what came of it.

    Raises:
        UnsuitedConfigError: The config has several barriers, or one with an outer stiffness.
    """
    _check_barriers(config)
    tried: dict[float, str] = {}
    runs: dict[float, Result] = {}
    can_be_enough = True

    def is_enough(stiffness: float) -> bool:
        nonlocal can_be_enough
        guarded = with_barrier(config, stiffness)
        # Of a tied body with springs not every start is proved to converge, so be brief about it.
        proof = prove(guarded, brief=True)
        tried[stiffness] = _description(proof)
        # A form of the energy for which nothing is found is the same for all stiffnesses.
        found = proof.states or (proof.unwrapped and proof.unwrapped.states)
        can_be_enough = bool(found) and not proof.needs_lengths
        if proof.every_start:
            runs[stiffness] = simulate(guarded)
        left = RunStatus.RANGE_LEFT
        stays = stiffness in runs and runs[stiffness].status != left
        if proof.every_start and not stays:
            tried[stiffness] += ", but the run leaves the range numerically (range_bound)"
        on_tried(stiffness, tried[stiffness])
        return stays

    found = next((k for k in LADDER if can_be_enough and is_enough(k)), None)
    if found is not None and found != LADDER[0]:
        found = _refined(LADDER[LADDER.index(found) - 1], found, is_enough)
    name = guard_name(config, BARRIER)
    given = outcome_of(simulate(config), config, name)
    if found is None:
        return Guarded(None, None, tuple(tried.items()), given, None)
    guarded = with_barrier(config, found)
    outcome = outcome_of(runs[found], guarded, name)
    return Guarded(guarded, found, tuple(tried.items()), given, outcome)


def _check_barriers(config: Config) -> None:
    """Reject a config with barriers that one barrier of θ2 would not replace."""
    check_single(config, BARRIER, "barriers")
    for name in guards_of(config, BARRIER):
        section = config.elements[name]
        if section.outer_stiffness:
            raise UnsuitedConfigError(
                f"elements.{name}.outer_stiffness: is {section.outer_stiffness:g}, and a barrier "
                "on θ2 alone would take its place (expected 0)"
            )


def _description(proof: Proof) -> str:
    """Return what a proof with a barrier says, as text."""
    if proof.every_start:
        return "every start converges: proved"
    if proof.needs_lengths:
        return "a spring of a body that is not held may lose its length on the way"
    if proof.unwrapped is not None and len(proof.unwrapped.states) > 1:
        states = proof.unwrapped.states
        return f"{len(states)} rest states {ANY_ANGLES}: {kinds_of(states)}"
    if proof.unwrapped is None and len(proof.states) > 1:
        return f"{len(proof.states)} rest states in the range: {kinds_of(proof.states)}"
    return proof.outcome


def with_barrier(config: Config, stiffness: float) -> Config:
    """Return a config of schema version 2 with one barrier of this stiffness, N m."""
    barrier = {"kind": "guard", "method": "barrier", "stiffness": stiffness}
    return with_guard(config, barrier, BARRIER)


def _refined(low: float, high: float, is_enough: Callable[[float], bool]) -> float:
    """Return a smaller stiffness in (low, high] that is enough, of two digits; or high."""
    for _ in range(REFINEMENTS):
        middle = float(f"{np.sqrt(low * high):.2g}")
        if not low < middle < high:
            break
        if is_enough(middle):
            high = middle
        else:
            low = middle
    return high
