"""How the eigenvalues at the rest state move with one gain."""

from typing import Any, NamedTuple

import numpy as np

from rbstab.analysis.linearisation import Linearisation, linearise
from rbstab.analysis.rest_state import nearest_rest_state
from rbstab.config.build import problem_of
from rbstab.config.load import load_config, resolved
from rbstab.config.schema import Config
from rbstab.experiment.switching_record import resting_system
from rbstab.mechanics.numbers import Array


class LocusPoint(NamedTuple):
    """One point of a root locus: the factor on the gain, and the linearised system there.

    found tells whether there is a rest state within the range; without one there is no
    linearisation.
    """

    factor: float
    found: bool
    linearisation: Linearisation | None


def root_locus(config: Config, key: str, factors: Array) -> list[LocusPoint]:
    """The linearised system for each factor on one gain.

    Each is taken at the rest state that is reached downhill from the unloaded position. The
    eigenvalues of a point stand in the order in which they continue those of the point before.

    Args:
        config: The config.
        key: Where its gain stands, such as `controller.K_r`.
        factors: Shape (n,), by which the whole gain is multiplied.

    Raises:
        KeyError: There is no such key.
        ConfigError: A scaled config is wrong.
    """
    points: list[LocusPoint] = []
    before: Array | None = None
    for factor in factors.tolist():
        system = resting_system(problem_of(scaled(config, key, factor)))
        rest = nearest_rest_state(system)
        if not rest.found:
            points.append(LocusPoint(factor, False, None))
            continue
        made = linearise(system, rest.motion, rest.own)
        if before is not None:
            made = _continued(made, before)
        before = made.eigenvalues
        points.append(LocusPoint(factor, True, made))
    return points


def scaled(config: Config, key: str, factor: float) -> Config:
    """A config with one of its values, number by number, multiplied by a factor.

    Raises:
        KeyError: There is no such key, or it holds no numbers.
        ConfigError: The scaled config is wrong.
    """
    data = resolved(config)
    *sections, last = key.split(".")
    owner: Any = data
    for section in sections:
        owner = owner[section]
    if not isinstance(owner, dict):
        raise KeyError(key)
    owner[last] = _times(owner[last], factor, key)
    return load_config(data)


def _times(value: Any, factor: float, key: str) -> Any:
    if isinstance(value, list):
        return [_times(entry, factor, key) for entry in value]
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise KeyError(key)
    return value * factor


def _continued(made: Linearisation, before: Array) -> Linearisation:
    """The same with its eigenvalues in the order of those nearest before."""
    # Imported late: scipy.optimize takes as long as a whole table.
    from scipy.optimize import linear_sum_assignment

    distance = np.abs(before[:, None] - made.eigenvalues[None, :])
    _, order = linear_sum_assignment(distance)
    return Linearisation(made.matrix, made.eigenvalues[order], made.modes[:, order], made.states)
