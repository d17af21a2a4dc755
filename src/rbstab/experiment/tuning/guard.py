"""A barrier of θ2 with which every start in the range is proved to converge; runs with a guard."""

from collections.abc import Callable, Collection
from dataclasses import replace
from itertools import chain, count
from typing import Any, NamedTuple

import numpy as np

from rbstab.config.build import system_of
from rbstab.config.load import changed_config, plain_data
from rbstab.config.schema import Config
from rbstab.elements.element import NO_STATE
from rbstab.experiment.answers.state_words import kinds_of
from rbstab.experiment.proof import prove
from rbstab.experiment.simulate import simulate
from rbstab.experiment.stored_proof.proof import Proof
from rbstab.experiment.summary import settling_time_of, summary_of
from rbstab.experiment.tuning.sensitivities import UnsuitedConfigError
from rbstab.integrate.status import RunStatus
from rbstab.mechanics.algebra import ZERO
from rbstab.mechanics.motion import motion_from_centre
from rbstab.mechanics.states import PITCH
from rbstab.store.result import Result

USUAL_NAME = "range"
"""The name of a guard in a config that has none; with a number if another element has it."""


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


def outcome_of(result: Result, config: Config, name: str) -> RunOutcome:
    """Return the outcome of a run.

    Args:
        result: The run.
        config: Its config.
        name: The name of the guard, if the config has it.
    """
    summary = summary_of(result)
    pitch = summary.largest_pitch
    couple = couple_at(config, name, pitch) if name in config.elements else 0.0
    return RunOutcome(
        RunStatus(result.status), pitch, settling_time_of(result), couple, summary.pitch_resolved
    )


def couple_at(config: Config, name: str, pitch: float) -> float:
    """Return the couple of a guard of θ2 at an angle θ2, N m.

    It depends on θ2 alone and never falls with |θ2|: at the largest |θ2| it is the largest.
    """
    system = system_of(config)
    element: Any = next(one for one in system.elements if one.name == name)
    Z = np.zeros(12)
    Z[PITCH] = pitch
    motion = motion_from_centre(system.body, ZERO, Z)
    if element.mode_count:
        modes = (element.guards(motion, NO_STATE) > 0).astype(float)
        element = replace(element, mode=modes)
    with np.errstate(all="ignore"):
        return float(np.linalg.norm(element.wrench(motion, NO_STATE).couple))


def with_guard(
    config: Config, guard: dict[str, Any] | None, methods: Collection[str | None]
) -> Config:
    """Return a config of schema version 2 with one guard in place of those of some methods.

    Without a guard, only these are left out; a config that has none is returned as it is.
    """
    names = guards_of(config, methods)
    if guard is None and not names:
        return config
    data = plain_data(config)
    elements: dict[str, Any] = data.get("elements", {})
    left = {name: element for name, element in elements.items() if name not in names}
    if guard is not None:
        left[guard_name(config, methods)] = guard
    return changed_config(config, data | {"schema_version": 2, "elements": left})


def guards_of(config: Config, methods: Collection[str | None]) -> list[str]:
    """Return the names of the guards of some methods in a config."""
    elements = config.elements.items()
    return [name for name, one in elements if getattr(one, "method", None) in methods]


def guard_name(config: Config, methods: Collection[str | None]) -> str:
    """Return the name of the first guard of some methods, or a free name for a new one."""
    possible = chain([USUAL_NAME], (f"{USUAL_NAME}_{number}" for number in count(2)))
    free = (name for name in possible if name not in config.elements)
    return next(chain(guards_of(config, methods), free))


def check_single(config: Config, methods: Collection[str | None], what: str) -> None:
    """Reject a config that needs no guard, or has several elements that one would replace.

    Raises:
        UnsuitedConfigError: The config has several, or its runs cannot leave the range.
    """
    if config.integration.coordinates == "quaternion":
        raise UnsuitedConfigError(
            "integration.coordinates: is 'quaternion', in which no run leaves the range (expected "
            "other coordinates)"
        )
    names = guards_of(config, methods)
    if len(names) > 1:
        raise UnsuitedConfigError(f"elements: has the {what} {', '.join(names)} (expected one)")


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
