"""The option --along of `rbstab stability`: root loci, as a table or as data."""

import math
from collections.abc import Iterable
from contextlib import suppress
from itertools import product
from typing import Any, NamedTuple

import click
import numpy as np

from rbstab.analysis.linearisation import eigenvalue_text
from rbstab.config.errors import ConfigError
from rbstab.config.schema import Config
from rbstab.experiment.answers.rounded import number
from rbstab.experiment.answers.threshold import named_number
from rbstab.experiment.locus import LocusPoint, check_key, root_locus, stable_from
from rbstab.mechanics.numbers import Array
from rbstab_cli.inputs import refuse
from rbstab_cli.printing import Table

MAX_POINTS = 10_000
"""The largest number of factors."""

NOT_FOUND = "none: a descent in energy from Θ = 0 found no smooth rest state in the range"
"""Where a point of a root locus has no eigenvalues. Other searches may find rest states."""


class Along(NamedTuple):
    """The key of a gain, and factors on it."""

    key: str
    factors: Array


class Locus(NamedTuple):
    """The root locus of a config along a gain.

    gain is the number that is scaled. stable is a sentence on the factors with which the rest state
    is stable; it is empty if there is none.
    """

    key: str
    gain: Any
    stable: str
    points: list[LocusPoint]


def parse_along(text: str) -> Along:
    """Parse KEY=FROM:TO:COUNT, where COUNT factors are geometrically spaced.

    Raises:
        UsageError: The text does not have that form.
    """
    key, _, numbers = text.partition("=")
    with suppress(ValueError):
        start, end, count = numbers.split(":")
        ends, points = (float(start), float(end)), int(count)
        if key and all(0 < end < math.inf for end in ends) and 1 <= points <= MAX_POINTS:
            return Along(key, np.geomspace(*ends, points))
    raise click.UsageError(
        f"--along {text}: expected KEY=FROM:TO:COUNT with factors above 0 and a count from 1 "
        f"to {MAX_POINTS}, such as controller.K_r=0.01:1:41"
    )


def checked_along(configs: Iterable[Config], texts: Iterable[str]) -> list[Along]:
    """Return the values of --along, before anything is computed; each config has their numbers.

    Raises:
        UsageError: A text does not have the form KEY=FROM:TO:COUNT.
    """
    alongs = list(map(parse_along, texts))
    problems: list[str] = []
    for config, along in product(configs, alongs):
        try:
            check_key(config, along.key)
        except ConfigError as error:
            problems += map(str, error.problems)
    refuse(problems)
    return alongs


def locus_of(config: Config, along: Along) -> Locus:
    """Compute the root locus of a config along a gain that it has.

    Raises:
        UsageError: A scaled config is not valid.
    """
    gain = named_number(config, tuple(along.key.split(".")))
    try:
        points = root_locus(config, along.key, along.factors)
    except ConfigError as error:
        raise click.UsageError(f"--along: {error}") from error
    return Locus(along.key, gain, stable_from(config, gain, points), points)


def locus_data(locus: Locus) -> dict[str, Any]:
    """Return a root locus as plain data."""
    gain = locus.gain
    return {
        "key": locus.key,
        "number": gain.name,
        "unit": gain.unit,
        "stable": locus.stable or None,
        "points": [
            {
                "factor": factor,
                "value": factor * gain.value,
                "found": linear is not None,
                "orientation": Theta,
                "eigenvalues": []
                if linear is None
                else [[float(v.real), float(v.imag)] for v in linear.eigenvalues],
            }
            for factor, linear, Theta in locus.points
        ],
    }


def print_locus(locus: Locus) -> None:
    """Print a root locus: a row for each factor."""
    gain, points = locus.gain, locus.points
    numbers = ("factor", gain.text, "largest Re λ [1/s]", "smallest ζ", "growing")
    table = Table(*numbers, "eigenvalues [1/s]", numbers=numbers)
    click.echo(f"Along {locus.key}:")
    if _has_no_effect(points):
        # So it is with the force of a sliding connector, which only has to be large enough.
        click.echo(f"  {locus.key} does not change the linearised system.")
        points = points[:1]
    for factor, linear, _ in points:
        cells = ["-", "-", "-", NOT_FOUND]
        if linear is not None:
            values = linear.eigenvalues
            cells = [
                number(float(values.real.max())),
                number(float(linear.damping_ratios.min())),
                str(linear.growing),
                ", ".join(eigenvalue_text(v) for v in values.tolist() if v.imag >= 0),
            ]
        table.add(number(factor), number(factor * gain.value), *cells)
    table.print()
    if locus.stable:
        click.echo(f"  {locus.stable[:1].upper()}{locus.stable[1:]}.\n")


def _has_no_effect(points: list[LocusPoint]) -> bool:
    """Whether all points have the same eigenvalues, bit for bit."""
    systems = [point.linearisation for point in points]
    values = {None if one is None else one.eigenvalues.tobytes() for one in systems}
    return len(points) > 1 and len(values) == 1 and None not in values
