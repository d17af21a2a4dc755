"""Root locus: the eigenvalues at the rest state as a function of one gain."""

from contextlib import suppress
from typing import Any, NamedTuple

import numpy as np

from rbstab.analysis.linearisation import Linearisation, NoDerivativesError, linearise
from rbstab.analysis.rest_state import nearest_rest_state
from rbstab.analysis.rest_system import smooth_rest_system
from rbstab.config.build import problem_of
from rbstab.config.entries import entries_of, value_at
from rbstab.config.errors import (
    ConfigError,
    ConfigProblem,
    Location,
    closest_keys,
    did_you_mean,
    shortened,
)
from rbstab.config.load import changed_config, resolved
from rbstab.config.schema import Config
from rbstab.mechanics.numbers import Array


class LocusPoint(NamedTuple):
    """One point of a root locus: the factor on the gain, and the linearised system.

    If found is False, the descent found no rest state within the range, and linearisation is None.
    """

    factor: float
    found: bool
    linearisation: Linearisation | None


def root_locus(config: Config, key: str, factors: Array) -> list[LocusPoint]:
    """Linearise the system for each factor on one gain.

    Each system is linearised at the rest state that a descent from the unloaded position reaches.
    The eigenvalues of each point are sorted to continue those of the previous point.

    Args:
        config: The config.
        key: Key of the gain, such as `controller.K_r`.
        factors: Factors by which the whole gain is multiplied, shape (n,).

    Raises:
        KeyError: There is no such key.
        ConfigError: A scaled config is not valid.
    """
    points: list[LocusPoint] = []
    previous: Array | None = None
    for factor in factors.tolist():
        at_factor = linearised_at_rest(scaled(config, key, factor))
        if at_factor is None:
            points.append(LocusPoint(factor, False, None))
            continue
        if previous is not None:
            at_factor = _matched(at_factor, previous)
        previous = at_factor.eigenvalues
        points.append(LocusPoint(factor, True, at_factor))
    return points


def linearised_at_rest(config: Config) -> Linearisation | None:
    """Linearise the system of a config at the rest state that a descent reaches.

    Returns:
        The linearised system; None if the descent found no rest state within the range, or only one
        at which the equations have a kink, or no derivatives.
    """
    system = smooth_rest_system(problem_of(config))
    rest = nearest_rest_state(system)
    if not rest.found or rest.on_kink:
        return None
    with suppress(NoDerivativesError):
        return linearise(system, rest.motion, rest.own)
    return None


def scaled(config: Config, key: str, factor: float) -> Config:
    """Return a config with all numbers of one of its values multiplied by a factor.

    Raises:
        KeyError: There is no such key, or it holds no numbers.
        ConfigError: The scaled config is not valid.
    """
    data = resolved(config)
    *sections, last = key.split(".")
    owner: Any = data
    for section in sections:
        owner = owner.get(section) if isinstance(owner, dict) else None
    if not isinstance(owner, dict):
        raise KeyError(key)
    owner[last] = _multiplied(owner[last], factor, key)
    return changed_config(config, data)


def check_key(config: Config, key: str) -> None:
    """Check that a value of a config can be multiplied; the error names the keys that were meant.

    Raises:
        ConfigError: There is no such key, it holds no numbers, or all of them are 0.
    """
    where = Location(f"--along {shortened(key)}")
    try:
        scaled(config, key, 1.0)
        if not np.any(value_at(config, tuple(key.split(".")))):
            problem = f"{shortened(key)} is 0, so no factor changes it"
            expected = f"expected a config with {shortened(key)} above 0"
            raise ConfigError([ConfigProblem(where, "", problem, expected)])
    except KeyError as error:
        own = dict.fromkeys(one.key.partition("[")[0] for one in entries_of(config))
        known = [name for name in own if not name.startswith("initial.")]
        meant = closest_keys(key.partition("[")[0], known)
        expected = f"expected one of {', '.join(known)}"
        expected = did_you_mean(meant) or expected
        problem = f"{shortened(key)} has no numbers that a factor can scale"
        raise ConfigError([ConfigProblem(where, "", problem, expected)]) from error


def _multiplied(value: Any, factor: float, key: str) -> Any:
    if isinstance(value, list):
        return [_multiplied(entry, factor, key) for entry in value]
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise KeyError(key)
    return value * factor


def _matched(now: Linearisation, previous: Array) -> Linearisation:
    """Match the eigenvalues to the nearest previous ones, and sort them in the same order."""
    # Imported late: importing scipy.optimize takes as long as computing a whole table.
    from scipy.optimize import linear_sum_assignment

    distance = np.abs(previous[:, None] - now.eigenvalues[None, :])
    _, order = linear_sum_assignment(distance)
    return Linearisation(
        now.matrix,
        now.eigenvalues[order],
        now.modes[:, order],
        now.states,
    )
