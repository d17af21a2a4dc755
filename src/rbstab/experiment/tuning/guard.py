"""A guard of θ2 with which motions are proved to keep the range, and what it does in a run."""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from rbstab.config.build import system_of
from rbstab.config.load import changed_config
from rbstab.config.schema import Config
from rbstab.elements.element import NO_STATE
from rbstab.experiment.answers.state_words import kinds_of
from rbstab.experiment.proof import prove
from rbstab.experiment.simulate import simulate
from rbstab.experiment.stored_proof.proof import Proof
from rbstab.experiment.summary import settling_time_of, summary_of
from rbstab.experiment.tuning.sensitivities import UnsuitedConfigError
from rbstab.experiment.tuning.soft_guard import METHODS, Kept, NotDecidedError, unguarded
from rbstab.integrate.status import RunStatus
from rbstab.mechanics.states import PITCH
from rbstab.store.result import Result
from rbstab.systems.modes import with_modes_at

BARRIER = "barrier"
"""The method of the guard that is found for every start."""

USUAL_NAME = "range"
"""The name of a guard in a config that has none; with a number if another element has it."""

SOFT_ANGLE = 1.2
"""rad: the soft angle if none is given."""

ANY_ANGLES = "with |θ2| < π/2 and any θ1, θ3"
"""Where a barrier must leave a single rest state: it keeps θ2, and neither θ1 nor θ3."""

LADDER = tuple(float(f"{digit}e{power}") for power in range(-2, 5) for digit in (1, 2, 5))
"""N m: the stiffnesses that are tried, ascending, until one is enough."""

REFINEMENTS = 4
"""How often the gap below the first stiffness that is enough is halved, in logarithms."""

LEAVES = "the run leaves the range numerically"


class RunOutcome(NamedTuple):
    """A run in a few numbers.

    Attributes:
        status: The status of the run.
        largest_pitch: The largest |θ2|, rad.
        settling_time: The time after which v stays below v(0)/1000, s; NaN if it does not.
        largest_couple: The largest couple of the guard, N m; 0 without one.
        pitch_resolved: Whether the samples show the largest |θ2|; otherwise the true one, and with
            it the couple, may be larger.
    """

    status: RunStatus
    largest_pitch: float
    settling_time: float
    largest_couple: float
    pitch_resolved: bool = True


class Guarded(NamedTuple):
    """A config with a guard, and what the guard changes in its run.

    Attributes:
        config: The config with the guard; None if there is none, or if none is needed.
        strength: k, or K of a repelling guard; 0 if none is needed, None if there is none.
        given: The run of the given config.
        guarded: The run of the config with the guard; None without one.
        tried: Each stiffness of a barrier that was tried, with what came of it.
        reason: Why there is no soft guard; empty if there is one.
        kept: What is proved of the start with a soft guard; None without one.
        couple_bound: A bound of the couple of a soft guard while the range is kept, N m.
        limit_kept: Whether the couple is known to stay below the limit in the run; None without a
            limit.
    """

    config: Config | None
    strength: float | None
    given: RunOutcome
    guarded: RunOutcome | None = None
    tried: tuple[tuple[float, str], ...] = ()
    reason: str = ""
    kept: Kept | None = None
    couple_bound: float | None = None
    limit_kept: bool | None = None


def guard(
    config: Config,
    method: str = BARRIER,
    soft_angle: float = SOFT_ANGLE,
    limit: float | None = None,
    on_tried: Callable[[float, str], None] = lambda *_: None,
) -> Guarded:
    """Find a guard with which motions are proved to keep the range.

    A barrier has a stiffness with which every start is proved to converge. More is not always
    better: a barrier can bring rest states of its own. So the stiffnesses of `LADDER` are tried one
    after the other, and then some between the last one that is not enough and the first one that
    is. A smaller one outside these may do too. The exact motion then never leaves the range. A run
    stops at cos θ2 = `range_bound` though, where the barrier stores a finite energy. So the run
    must stay in the range as well.

    A soft guard has the least strength with which the start of the config keeps the range.

    Args:
        config: The config; a barrier, or a soft guard, in it is replaced.
        method: "barrier", or one of `METHODS`.
        soft_angle: θ_s of a soft guard, rad, between 0 and π/2.
        limit: The largest couple that a soft guard may have in the run, N m, or None.
        on_tried: Called with each stiffness of a barrier, N m, and what came of it.

    Raises:
        UnsuitedConfigError: The config has several such guards, or one that another would not
            replace; or its runs cannot leave the range.
    """
    _check(config, method)
    name = _name_in(config, method)
    nothing = Guarded(None, None, _outcome(simulate(config), config, name))
    if method == BARRIER:
        return _with_least_barrier(config, nothing, on_tried)
    try:
        start = unguarded(_replaced(config, method, None))
        if start.is_inside:
            return nothing._replace(strength=0.0)
        law = start.least_law(method, soft_angle)
        kept = start.kept(law)
    except NotDecidedError as error:
        return nothing._replace(reason=str(error))
    guarded = _replaced(config, method, law.gains)
    outcome = _outcome(simulate(guarded), guarded, name)
    left, bound = outcome.status is RunStatus.RANGE_LEFT, law.couple_bound
    # It is known by proof; or as seen, where the samples show the largest |θ2|.
    seen = outcome.pitch_resolved and outcome.largest_couple <= (limit or 0.0)
    return nothing._replace(
        config=None if left else guarded,
        strength=law.strength,
        guarded=outcome,
        reason=f"{LEAVES} (integration.range_bound)" if left else "",
        kept=kept,
        couple_bound=bound,
        limit_kept=None if limit is None else bound <= limit or seen,
    )


def with_barrier(config: Config, stiffness: float) -> Config:
    """Return a config of schema version 2 with one barrier of this stiffness, N m."""
    return _replaced(config, BARRIER, {"stiffness": stiffness})


def _with_least_barrier(
    config: Config, nothing: Guarded, on_tried: Callable[[float, str], None]
) -> Guarded:
    tried: dict[float, str] = {}
    runs: dict[float, Result] = {}
    hopeless = False

    def is_enough(stiffness: float) -> bool:
        nonlocal hopeless
        guarded = with_barrier(config, stiffness)
        # Of a tied body with springs not every start is proved to converge, so be brief about it.
        proof = prove(guarded, brief=True)
        tried[stiffness] = _description(proof)
        # A form of the energy for which nothing is found is the same for all stiffnesses.
        rest_states = proof.states or (proof.unwrapped and proof.unwrapped.states)
        hopeless = not rest_states or proof.needs_lengths
        enough = proof.every_start
        if enough:
            runs[stiffness] = simulate(guarded)
            enough = runs[stiffness].status != RunStatus.RANGE_LEFT
            tried[stiffness] += "" if enough else f", but {LEAVES} (range_bound)"
        on_tried(stiffness, tried[stiffness])
        return enough

    low, high = 0.0, math.inf
    for stiffness in LADDER:
        if hopeless or high < math.inf:
            break
        low, high = (low, stiffness) if is_enough(stiffness) else (stiffness, high)
    if high == math.inf:
        return nothing._replace(tried=tuple(tried.items()))
    for _ in range(REFINEMENTS if low else 0):
        middle = float(f"{math.sqrt(low * high):.2g}")
        if not low < middle < high:
            break
        low, high = (low, middle) if is_enough(middle) else (middle, high)
    guarded = with_barrier(config, high)
    outcome = _outcome(runs[high], guarded, _name_in(config, BARRIER))
    return nothing._replace(
        config=guarded, strength=high, guarded=outcome, tried=tuple(tried.items())
    )


def _description(proof: Proof) -> str:
    """Return what a proof with a barrier says, as text."""
    if proof.every_start:
        return "every start converges: proved"
    if proof.needs_lengths:
        return "a spring of a body that is not held may lose its length on the way"
    where, states = "in the range", proof.states
    if proof.unwrapped is not None:
        where, states = ANY_ANGLES, proof.unwrapped.states
    if len(states) > 1:
        return f"{len(states)} rest states {where}: {kinds_of(states)}"
    return proof.outcome


def _outcome(result: Result, config: Config, name: str) -> RunOutcome:
    """Return the outcome of a run of a config, with the couple of the guard of a name."""
    summary = summary_of(result)
    pitch, couple = summary.largest_pitch, 0.0
    if name in config.elements:
        system = system_of(config)
        y = np.zeros(system.size)
        # The couple depends on θ2 alone and never falls with |θ2|: at the largest |θ2| it is the
        # largest.
        y[PITCH] = pitch
        with np.errstate(all="ignore"):
            acting = with_modes_at(system, y)
            element: Any = next(
                candidate for candidate in acting.elements if candidate.name == name
            )
            couple = float(np.linalg.norm(element.wrench(acting.motion(y), NO_STATE).couple))
    status, settling = RunStatus(result.status), settling_time_of(result)
    return RunOutcome(status, pitch, settling, couple, summary.pitch_resolved)


def _guards_of(config: Config, method: str) -> list[str]:
    """Return the names of the guards of a config that one of a method replaces."""
    replaced = METHODS if method in METHODS else (method,)
    elements = config.elements.items()
    return [name for name, section in elements if getattr(section, "method", None) in replaced]


def _name_in(config: Config, method: str) -> str:
    """Return the name of the first guard that one of a method replaces, or a free name."""
    name, number = USUAL_NAME, 1
    while name in config.elements:
        number += 1
        name = f"{USUAL_NAME}_{number}"
    return next(iter(_guards_of(config, method)), name)


def _replaced(config: Config, method: str, gains: dict[str, float] | None) -> Config:
    """Return a config of schema version 2 with one guard, or none, in place of those like it."""
    # In quaternions no run would leave the range.
    data = config.in_angles().plain()
    names = _guards_of(config, method)
    elements = {k: section for k, section in data.get("elements", {}).items() if k not in names}
    if gains is not None:
        guard = {"kind": "guard", "method": method, **gains}
        elements[_name_in(config, method)] = guard
    return changed_config(config, data | {"schema_version": 2, "elements": elements})


def _check(config: Config, method: str) -> None:
    """Reject a config with guards that one guard would not replace, or that needs none."""
    names, barriers = _guards_of(config, method), _guards_of(config, BARRIER)
    if len(names) > 1:
        what = "barriers" if method == BARRIER else "soft guards"
        raise UnsuitedConfigError(f"elements: has the {what} {', '.join(names)} (expected one)")
    for name in barriers:
        outer = config.elements[name].outer_stiffness
        if method != BARRIER:
            raise UnsuitedConfigError(
                f"elements.{name}: is a barrier, which keeps every motion in the range "
                "(expected none beside a soft guard)"
            )
        if outer:
            raise UnsuitedConfigError(
                f"elements.{name}.outer_stiffness: is {outer:g}, and a barrier on θ2 alone would "
                "take its place (expected 0)"
            )
