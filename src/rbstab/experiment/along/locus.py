"""Root locus: the eigenvalues at the rest state as a function of one parameter."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rbstab.analysis.linearisation import Linearisation, NoDerivativesError, linearise
from rbstab.analysis.rest_state import nearest_rest_state
from rbstab.analysis.rest_system import smooth_rest_system
from rbstab.config.build import problem_of
from rbstab.config.schema import Config
from rbstab.experiment.along.parameter import Parameter
from rbstab.experiment.answers.threshold import NamedNumber, alike, threshold_of
from rbstab.experiment.answers.wanted import wanted
from rbstab.mechanics.numbers import Array


class LocusPoint(NamedTuple):
    """One point of a root locus: the value of the parameter, and the linearised system.

    orientation is Θ of the rest state, rad. Both are None if the descent found no rest state within
    the range, or one without derivatives.
    """

    parameter: float
    linearisation: Linearisation | None = None
    orientation: tuple[float, ...] | None = None


def root_locus(config: Config, parameter: Parameter) -> list[LocusPoint]:
    """Linearise the system for each value of a parameter.

    Each system is linearised at the rest state that a descent from the unloaded position reaches.
    The eigenvalues of each point are sorted to continue those of the previous point.

    Args:
        config: The config.
        parameter: The parameter, which the config has.

    Raises:
        ConfigError: A changed config is not valid.
    """
    points: list[LocusPoint] = []
    previous: Array | None = None
    for value in parameter.values.tolist():
        point = _point(value, parameter.at(config, value))
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


def _point(parameter: float, config: Config) -> LocusPoint:
    system = smooth_rest_system(problem_of(config))
    rest = nearest_rest_state(system)
    if rest.rests_in_range and not rest.on_kink:
        with suppress(NoDerivativesError):
            linear = linearise(system, rest.motion, rest.element_states)
            return LocusPoint(parameter, linear, tuple(rest.motion.Theta.tolist()))
    return LocusPoint(parameter)


def stable_from(
    config: Config, number: NamedNumber, values: Array, points: Sequence[LocusPoint]
) -> str:
    """Return from which value of a number on the body rests as desired, by the eigenvalues.

    Args:
        config: The config, which says what is desired.
        number: The number, with its value in the config.
        values: Its values along a root locus.
        points: The root locus.

    Returns:
        A sentence without a full stop; "" if the desired rest state is stable, or unstable, along
        all of it, or changes more than once.
    """
    aim = wanted(config)
    reached = [point.orientation is not None and aim.holds(point.orientation) for point in points]
    linear = [point.linearisation for point in points]
    largest = np.array(
        [
            np.nan if linearisation is None else linearisation.eigenvalues.real.max()
            for linearisation in linear
        ]
    )
    good = np.array(reached) & (largest < 0)
    bad = ~np.isnan(largest) & (~np.array(reached) | (largest > 0))
    threshold = threshold_of(values, good, bad)
    if threshold is None or threshold.bad is None:
        return ""
    text, unit = alike([threshold.good, threshold.bad]), f" {number.unit}" if number.unit else ""
    last_bad = int(np.flatnonzero(values == threshold.bad)[0])
    other = "unstable there" if reached[last_bad] else "it leans farther"
    return (
        f"the body at rest at its desired attitude, {aim}, is stable for {number.name} "
        f"{threshold.sign(good=True)} {text[threshold.good]}{unit}; {other} for "
        f"{threshold.sign(good=False)} {text[threshold.bad]} (by the eigenvalues)"
    )


def _matched(now: Linearisation, previous: Array) -> Linearisation:
    """Match the eigenvalues to the nearest previous ones, and sort them in the same order."""
    # Imported late: importing scipy.optimize takes as long as computing a whole table.
    from scipy.optimize import linear_sum_assignment

    distance = np.abs(previous[:, None] - now.eigenvalues[None, :])
    _, order = linear_sum_assignment(distance)
    return replace(now, eigenvalues=now.eigenvalues[order], modes=now.modes[:, order])
