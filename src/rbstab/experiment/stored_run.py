"""What is read from the result of a run: its config, its certificate, its own and final states."""

import math
from typing import Any, NamedTuple

from rbstab.analysis.certificate.verdict import Check
from rbstab.config.errors import ConfigError
from rbstab.config.load import validated
from rbstab.config.schema import Config
from rbstab.config.source import parse_source
from rbstab.elements.registry import OWN_STATES
from rbstab.store.result import Result
from rbstab.systems.quantities import is_element_state


def own_states_of(result: Result) -> tuple[str, ...]:
    """Return the names of the own states of named elements.

    The numbers of the entries of one, such as `cord.creep_component`, are an array too, but no own
    state: it is the scale of a dimension.
    """
    return tuple(
        name
        for name, variable in result.variables.items()
        if is_element_state(name) and variable.dimensions != (name,)
    )


def final_state(result: Result) -> dict[str, list[float]]:
    """Return the state of the body and of the elements at the end, by the names of its arrays."""
    body = ("orientation", "angular_velocity", "position", "velocity")
    names = (*body, *OWN_STATES, *own_states_of(result))
    return {name: result[name][-1].tolist() for name in names if name in result}


class StoredConfig(NamedTuple):
    """A config, and its text as plain data.

    config is None if this version of the program cannot read it. data is the parsed text, which may
    be invalid as a config; it is empty if the text is not a YAML mapping.
    """

    config: Config | None
    data: dict[str, Any]


def stored_config(result: Result) -> StoredConfig:
    """Return the config of a result."""
    try:
        source = parse_source(result.config, "config")
    except ConfigError:
        return StoredConfig(None, {})
    if not isinstance(source.data, dict):
        return StoredConfig(None, {})
    try:
        return StoredConfig(validated(source), source.data)
    except ConfigError:
        return StoredConfig(None, source.data)


POSITIVE = "positive"
"""The name of the check of the sign of v."""


def certificate_lines(result: Result) -> list[Check]:
    """Return the checks of the certificate; [] for a result without one."""
    names = [f"certificate/{column}" for column in Check._fields]
    if any(name not in result for name in names):
        return []
    return [Check(*row) for row in zip(*(result[name].tolist() for name in names), strict=True)]


def compares_v_minus_work(line: Check) -> bool:
    """Return whether a line is the check of the sign of v - ε, which has no lower bound."""
    return line.check == POSITIVE and line.bound == -math.inf
