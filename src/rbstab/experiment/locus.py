"""Root locus: the eigenvalues at the rest state as a function of one gain."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rbstab.analysis.linearisation import Linearisation, NoDerivativesError, linearise
from rbstab.analysis.rest_state import nearest_rest_state
from rbstab.analysis.rest_system import smooth_rest_system
from rbstab.config.build import problem_of
from rbstab.config.errors import (
    ConfigError,
    Location,
    closest_keys,
    did_you_mean,
)
from rbstab.config.load import with_numbers
from rbstab.config.numbers import changed_numbers, keys_of
from rbstab.config.schema import Config
from rbstab.config.units import number_key
from rbstab.experiment.answers.threshold import NamedNumber, alike, threshold_of
from rbstab.experiment.answers.wanted import wanted
from rbstab.files.names import shortened
from rbstab.mechanics.numbers import Array


class LocusPoint(NamedTuple):
    """One point of a root locus: the factor on the gain, and the linearised system.

    orientation is Θ of the rest state, rad. Both are None if the descent found no rest state within
    the range, or one without derivatives.
    """

    factor: float
    linearisation: Linearisation | None = None
    orientation: tuple[float, ...] | None = None


def root_locus(config: Config, key: str, factors: Array) -> list[LocusPoint]:
    """Linearise the system for each factor on one gain.

    Each system is linearised at the rest state that a descent from the unloaded position reaches.
    The eigenvalues of each point are sorted to continue those of the previous point.

    Args:
        config: The config.
        key: Key of the gain, such as `controller.K_r`.
        factors: Factors by which the whole gain is multiplied, shape (n,).

    Raises:
        LookupError: There is no such key, or it holds no numbers.
        ConfigError: A scaled config is not valid.
    """
    points: list[LocusPoint] = []
    previous: Array | None = None
    for factor in factors.tolist():
        point = _point(factor, scaled(config, key, factor))
        linear = point.linearisation
        if linear is not None and previous is not None:
            linear = _matched(linear, previous)
        previous = previous if linear is None else linear.eigenvalues
        points.append(point._replace(linearisation=linear))
    return points


def linearised_at_rest(config: Config) -> LocusPoint:
    """Linearise the system of a config at the rest state that a descent reaches.

    Returns:
        The rest state and the linearised system; without them if the descent found no rest state
        within the range, or only one at which the equations have a kink, or no derivatives.
    """
    return _point(1.0, config)


def _point(factor: float, config: Config) -> LocusPoint:
    system = smooth_rest_system(problem_of(config))
    rest = nearest_rest_state(system)
    if rest.found and not rest.on_kink:
        with suppress(NoDerivativesError):
            linear = linearise(system, rest.motion, rest.own)
            return LocusPoint(factor, linear, tuple(rest.motion.Theta.tolist()))
    return LocusPoint(factor)


def stable_from(config: Config, number: NamedNumber, points: Sequence[LocusPoint]) -> str:
    """Return from which value of a gain on the body rests as desired, by the eigenvalues.

    Args:
        config: The config, which says what is desired.
        number: The gain, with its value in the config.
        points: The root locus along it.

    Returns:
        A sentence without a full stop; "" if the desired rest state is stable, or unstable, along
        all of it, or changes more than once.
    """
    aim = wanted(config)
    reached = [point.orientation is not None and aim.holds(point.orientation) for point in points]
    linear = [point.linearisation for point in points]
    largest = np.array([np.nan if one is None else one.eigenvalues.real.max() for one in linear])
    good = np.array(reached) & (largest < 0)
    bad = ~np.isnan(largest) & (~np.array(reached) | (largest > 0))
    values = number.value * np.array([point.factor for point in points])
    found = threshold_of(values, good, bad)
    if found is None or found.bad is None:
        return ""
    text, unit = alike([found.good, found.bad]), f" {number.unit}" if number.unit else ""
    last_bad = int(np.flatnonzero(values == found.bad)[0])
    other = "unstable there" if reached[last_bad] else "it leans farther"
    return (
        f"the body at rest at its desired attitude, {aim}, is stable for {number.name} "
        f"{found.sign(good=True)} {text[found.good]}{unit}; {other} for "
        f"{found.sign(good=False)} {text[found.bad]} (by the eigenvalues)"
    )


def scaled(config: Config, key: str, factor: float) -> Config:
    """Return a config with all numbers of one of its values multiplied by a factor.

    Raises:
        LookupError: There is no such key, or it holds no numbers.
        ConfigError: The scaled config is not valid.
    """
    read = number_key(key)
    if read is None:
        raise LookupError(key)
    return with_numbers(config, changed_numbers(config, read, factor, scale=True))


def check_key(config: Config, key: str) -> None:
    """Check that a value of a config can be multiplied; the error names the keys that were meant.

    Raises:
        ConfigError: There is no such key, it holds no numbers, or all of them are 0.
    """
    where = Location(f"--along {shortened(key)}")
    try:
        doubled = scaled(config, key, 2.0)
    except LookupError as error:
        known = [name for name in keys_of(config) if not name.startswith("initial.")]
        meant = closest_keys(key.partition("[")[0], known)
        expected = f"expected one of {', '.join(known)}"
        expected = did_you_mean(meant) or expected
        problem = f"{shortened(key)} has no numbers that a factor can scale"
        raise ConfigError.at(where, problem, expected) from error
    if doubled == config:
        problem = f"{shortened(key)} is 0, so no factor changes it"
        expected = f"expected a config with {shortened(key)} above 0"
        raise ConfigError.at(where, problem, expected)


def _matched(now: Linearisation, previous: Array) -> Linearisation:
    """Match the eigenvalues to the nearest previous ones, and sort them in the same order."""
    # Imported late: importing scipy.optimize takes as long as computing a whole table.
    from scipy.optimize import linear_sum_assignment

    distance = np.abs(previous[:, None] - now.eigenvalues[None, :])
    _, order = linear_sum_assignment(distance)
    return replace(now, eigenvalues=now.eigenvalues[order], modes=now.modes[:, order])
