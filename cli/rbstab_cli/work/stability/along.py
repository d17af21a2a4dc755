"""The option --along of `rbstab stability`: root loci and rest states, as tables or as data."""

import math
from collections.abc import Callable, Iterable
from contextlib import suppress
from decimal import Decimal
from itertools import product
from typing import Any, NamedTuple

import click
import numpy as np

from rbstab.analysis.linearisation import eigenvalue_text
from rbstab.config.errors import ConfigError
from rbstab.config.schema import Config
from rbstab.experiment.along.locus import LocusPoint, root_locus, stable_from
from rbstab.experiment.along.parameter import Parameter
from rbstab.experiment.along.rest_states import AlongStates, states_along
from rbstab.experiment.answers.rounded import number, rounded_down, rounded_up
from rbstab.experiment.answers.state_words import angles
from rbstab.experiment.answers.threshold import NamedNumber
from rbstab.report.model.figure import Axis
from rbstab_cli.inputs import refuse
from rbstab_cli.printing import Table

MAX_POINTS = 10_000
"""The largest number of values."""

NO_SMOOTH_STATE = "none: a descent in energy from Θ = 0 found no smooth rest state in the range"
"""Where a point of a root locus has no eigenvalues. Other searches may find rest states."""

DIGITS = 6
"""Significant digits of the values at which rest states change."""


class Locus(NamedTuple):
    """What changes in a config along a parameter.

    gain is its number. stable is a sentence on the values with which the rest state is stable; it
    is empty if there is none. states are all rest states.
    """

    parameter: Parameter
    gain: NamedNumber
    stable: str
    points: list[LocusPoint]
    states: AlongStates

    @property
    def axis(self) -> Axis:
        """The parameter and its unit."""
        given = self.parameter
        return Axis(f"factor on {given.key}") if given.scales else Axis(*self.gain[:2])

    def value(self, parameter: Any) -> Any:
        """Return the number at a value of the parameter, or at several."""
        return parameter * self.gain.value if self.parameter.scales else parameter


def parse_along(text: str) -> Parameter:
    """Parse KEY=FROM:TO:COUNT, values evenly spaced, or KEY=xFROM:xTO:COUNT, factors on a gain.

    Raises:
        UsageError: The text does not have that form.
    """
    key, _, numbers = text.partition("=")
    scales = numbers.startswith("x") and ":x" in numbers
    with suppress(ValueError):
        start, end, count = (numbers.replace("x", "") if scales else numbers).split(":")
        low, high = float(start), float(end)
        good = math.isfinite(low - high) and (min(low, high) > 0 or not scales)
        if key and good and 1 <= int(count) <= MAX_POINTS:
            values = (np.geomspace if scales else np.linspace)(low, high, int(count))
            return Parameter(key, values, scales)
    raise click.UsageError(
        f"--along {text}: expected KEY=FROM:TO:COUNT with values of one number, such as "
        "controller.K_r[0]=1:20:41, or KEY=xFROM:xTO:COUNT with factors above 0 on a whole gain, "
        f"such as controller.K_r=x0.1:x2:41, and a count from 1 to {MAX_POINTS}"
    )


def checked_along(configs: Iterable[Config], texts: Iterable[str]) -> list[Parameter]:
    """Return the values of --along, before anything is computed; each config has their numbers.

    Raises:
        UsageError: A text does not have one of its forms.
    """
    parameters = list(map(parse_along, texts))
    problems: list[str] = []
    for config, parameter in product(configs, parameters):
        try:
            parameter.check(config)
        except ConfigError as error:
            problems += map(str, error.problems)
    refuse(problems)
    return parameters


def locus_of(config: Config, parameter: Parameter, is_late: Callable[[], bool]) -> Locus:
    """Compute the root locus and all rest states of a config along a parameter that it has.

    Args:
        config: The config.
        parameter: The parameter.
        is_late: Returns whether no further interval is to be tried.

    Raises:
        UsageError: A changed config is not valid.
    """
    gain = parameter.named(config)
    try:
        points = root_locus(config, parameter)
    except ConfigError as error:
        raise click.UsageError(f"--along: {error}") from error
    locus = Locus(parameter, gain, "", points, states_along(config, parameter, is_late))
    values = locus.value(parameter.values)
    return locus._replace(stable=stable_from(config, gain, values, points))


def locus_data(locus: Locus) -> dict[str, Any]:
    """Return a root locus and the rest states along it as plain data."""
    gain, states, given = locus.gain, locus.states, locus.parameter
    return {
        "key": given.key,
        "number": gain.name,
        "unit": gain.unit,
        "stable": locus.stable or None,
        "points": [
            {
                "factor": at if given.scales else None,
                "value": locus.value(at),
                "found": linear is not None,
                "orientation": Theta,
                "eigenvalues": []
                if linear is None
                else [[float(v.real), float(v.imag)] for v in linear.eigenvalues],
            }
            for at, linear, Theta in locus.points
        ],
        "intervals": [interval._asdict() for interval in states.intervals],
        "why": states.why or None,
        "turns": [
            {"kind": kind, "at": at, "orientation": Theta.tolist()}
            for kind, at, Theta in states.turns
        ],
        "branches": [
            {name: values.tolist() for name, values in vars(branch).items()}
            for branch in states.branches
        ],
    }


def print_locus(locus: Locus) -> None:
    """Print a root locus, a row for each value, and then the rest states."""
    gain, points, key = locus.gain, locus.points, locus.parameter.key
    heads = ("factor", gain.text)[not locus.parameter.scales :]
    numbers = (*heads, "largest Re λ [1/s]", "smallest ζ", "growing")
    table = Table(*numbers, "eigenvalues [1/s]", numbers=numbers)
    click.echo(f"Along {key}:")
    if _has_no_effect(points):
        # So it is with the force of a sliding connector, which only has to be large enough.
        click.echo(f"  {key} does not change the linearised system.")
        points = points[:1]
    for at, linear, _ in points:
        cells = ["-", "-", "-", NO_SMOOTH_STATE]
        if linear is not None:
            values = linear.eigenvalues
            cells = [
                number(float(values.real.max())),
                number(float(linear.damping_ratios.min())),
                str(linear.growing),
                ", ".join(eigenvalue_text(v) for v in values.tolist() if v.imag >= 0),
            ]
        table.add(*[number(at), number(locus.value(at))][-len(heads) :], *cells)
    table.print()
    if locus.stable:
        click.echo(f"  {locus.stable[:1].upper()}{locus.stable[1:]}.\n")
    _print_states(locus)


def _print_states(locus: Locus) -> None:
    """Print how many rest states there are on intervals of the parameter, and where they change."""
    states = locus.states
    if states.intervals:
        numbers = (locus.axis.text, "rest states", "stable")
        table = Table(*numbers, "sure", numbers=numbers)
        for low, high, count, stable, proved, _ in states.intervals:
            inside, counts = " to ".join(_inside(low, high)), (str(count), str(stable))
            sure = "proved for each value" if proved else "seen; there may be others"
            if count is None:
                counts, sure = ("-", "-"), "not decided"
            table.add(inside, *counts, sure)
        table.print()
    for kind, at, Theta in states.turns:
        place = f"{number(at, DIGITS)}, Θ = {angles(Theta)} rad"
        click.echo(f"  {kind.capitalize()} at {locus.axis.label} = {place} (computed, not proved)")
    if states.why:
        click.echo(f"  Rest states along {locus.parameter.key}: not decided: {states.why}")
    click.echo()


def _inside(low: float, high: float) -> tuple[str, str]:
    """Return the ends of a part of an interval: what is proved for the whole holds for it."""
    ends = Decimal(repr(low)), Decimal(repr(high))
    texts = [(rounded_up(ends[0], n), rounded_down(ends[1], n)) for n in range(DIGITS, 18)]
    # A short interval needs more digits.
    return next((both for both in texts if float(both[0]) < float(both[1])), texts[-1])


def _has_no_effect(points: list[LocusPoint]) -> bool:
    """Whether points of several values have the same eigenvalues, bit for bit."""
    systems = [point.linearisation for point in points]
    values = {None if system is None else system.eigenvalues.tobytes() for system in systems}
    several = len({point.parameter for point in points}) > 1
    return several and len(values) == 1 and None not in values
