"""A barrier of θ2 with which every start in the range is proved to converge."""

from collections.abc import Callable
from itertools import chain, count
from typing import Any, NamedTuple

import numpy as np

from rbstab.analysis.settling import settling_times
from rbstab.config.load import changed_config, plain_data
from rbstab.config.schema import Config
from rbstab.experiment.proof import Proof, prove
from rbstab.experiment.simulate import simulate
from rbstab.experiment.summary import lyapunov_function_of, summary_of
from rbstab.experiment.tuning.sensitivities import UnsuitedConfigError
from rbstab.integrate.status import RunStatus
from rbstab.mechanics.numbers import Array
from rbstab.store.result import Result

LADDER = tuple(float(f"{digit}e{power}") for power in range(-2, 5) for digit in (1, 2, 5))
"""N m: the stiffnesses that are tried, ascending, until one is enough."""

REFINEMENTS = 4
"""How often the gap below the first stiffness that is enough is halved, in logarithms."""


class RunOutcome(NamedTuple):
    """A run in a few numbers.

    Attributes:
        status: The status of the run.
        largest_pitch: The largest |θ2|, rad.
        settling_time: The time after which v stays below v(0)/1000, s; NaN if it does not.
        largest_couple: The largest couple of the barrier, N m; 0 without one.
    """

    status: RunStatus
    largest_pitch: float
    settling_time: float
    largest_couple: float


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
    can_be_enough = True

    def is_enough(stiffness: float) -> bool:
        nonlocal can_be_enough
        guarded = with_barrier(config, stiffness)
        proof = prove(guarded)
        tried[stiffness] = _description(proof)
        # A form of the energy for which nothing is found is the same for all stiffnesses.
        can_be_enough = bool(proof.states or (proof.unwrapped and proof.unwrapped.states))
        stays = bool(proof.every_start) and not _leaves_range(guarded)
        if proof.every_start and not stays:
            tried[stiffness] += ", but the run leaves the range numerically (range_bound)"
        on_tried(stiffness, tried[stiffness])
        return stays

    found = next((k for k in LADDER if can_be_enough and is_enough(k)), None)
    if found is not None and found != LADDER[0]:
        found = _refined(LADDER[LADDER.index(found) - 1], found, is_enough)
    name = barrier_name(config)
    given = _outcome(simulate(config), name)
    if found is None:
        return Guarded(None, None, tuple(tried.items()), given, None)
    guarded = with_barrier(config, found)
    return Guarded(guarded, found, tuple(tried.items()), given, _outcome(simulate(guarded), name))


def _check_barriers(config: Config) -> None:
    """Reject a config with barriers that one barrier of θ2 would not replace."""
    sections = config.elements.items()
    barriers = {name: section for name, section in sections if _is_barrier(section.model_dump())}
    if len(barriers) > 1:
        raise UnsuitedConfigError(
            f"elements: has the barriers {', '.join(barriers)} (expected one)"
        )
    for name, section in barriers.items():
        if section.outer_stiffness:
            raise UnsuitedConfigError(
                f"elements.{name}.outer_stiffness: is {section.outer_stiffness:g}, and no proof "
                "takes it into account (expected 0)"
            )


def _leaves_range(config: Config) -> bool:
    return RunStatus(simulate(config).status) is RunStatus.RANGE_LEFT


def _description(proof: Proof) -> str:
    """Return what a proof with a barrier says, as text."""
    if proof.every_start:
        return "every start converges: proved"
    states = proof.states if proof.unwrapped is None else proof.unwrapped.states
    if len(states) > 1:
        return f"{len(states)} rest states with |θ2| < π/2"
    return proof.outcome


def with_barrier(config: Config, stiffness: float) -> Config:
    """Return a config of schema version 2 with one barrier of this stiffness, N m."""
    data: dict[str, Any] = plain_data(config) | {"schema_version": 2}
    barrier = {"kind": "guard", "method": "barrier", "stiffness": stiffness}
    name = barrier_name(config)
    elements = {n: e for n, e in data.get("elements", {}).items() if not _is_barrier(e)}
    return changed_config(config, data | {"elements": elements | {name: barrier}})


def barrier_name(config: Config) -> str:
    """Return the name of the barrier of a config, or a free name for a new one."""
    elements: dict[str, Any] = plain_data(config).get("elements", {})
    names = [name for name, element in elements.items() if _is_barrier(element)]
    possible = chain(["range"], (f"range_{number}" for number in count(2)))
    return names[0] if names else next(name for name in possible if name not in elements)


def _is_barrier(element: dict[str, Any]) -> bool:
    return element.get("method") == "barrier"


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


def _outcome(result: Result, name: str) -> RunOutcome:
    v = lyapunov_function_of(result)
    from_rest = result["orientation"][-1] - result["rest_orientation"]
    settled = settling_times(result["time"], v[np.newaxis], from_rest[np.newaxis])
    return RunOutcome(
        RunStatus(result.status),
        summary_of(result).largest_pitch,
        float(settled[0]),
        float(np.linalg.norm(_couples(result, name), axis=1).max(initial=0.0)),
    )


def _couples(result: Result, name: str) -> Array:
    """Return the couple of the barrier at each sample, shape (n, 3), N m; (0, 3) without one."""
    names = [str(name) for name in result["element"]] if "element" in result else []
    if name not in names:
        return np.zeros((0, 3))
    return result["element_couple"][:, names.index(name)]
