"""Configs with a guard of θ2, and what a guard does in a run."""

from collections.abc import Collection
from dataclasses import replace
from itertools import chain, count
from typing import Any, NamedTuple

import numpy as np

from rbstab.config.build import system_of
from rbstab.config.load import changed_config, plain_data
from rbstab.config.schema import Config
from rbstab.elements.element import NO_STATE
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
    """Reject a config with several elements that one guard would replace.

    Raises:
        UnsuitedConfigError: The config has several.
    """
    names = guards_of(config, methods)
    if len(names) > 1:
        raise UnsuitedConfigError(f"elements: has the {what} {', '.join(names)} (expected one)")
