"""The option --along of `rbstab stability`."""

from typing import TYPE_CHECKING, NamedTuple

import click

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from rbstab.config.schema import Config
    from rbstab.experiment.locus import LocusPoint

MAX_POINTS = 10_000
"""The largest number of factors."""


class Along(NamedTuple):
    """The key of a gain, and `points` factors on it, geometrically spaced from `start` to `end`."""

    key: str
    start: float
    end: float
    points: int

    @property
    def path(self) -> tuple[str, ...]:
        """The key as a path."""
        return tuple(self.key.split("."))


def parse_along(text: str) -> Along:
    """Parse KEY=FROM:TO:COUNT.

    Raises:
        UsageError: The text does not have that form.
    """
    key, equals, numbers = text.partition("=")
    try:
        start, end, count = numbers.split(":")
        along = Along(key, float(start), float(end), int(count))
    except ValueError:
        along = Along(key, 0.0, 0.0, 0)
    in_range = 0 < along.start < float("inf") and 0 < along.end < float("inf")
    if not (key and equals and in_range and 1 <= along.points <= MAX_POINTS):
        raise click.UsageError(
            f"--along {text}: expected KEY=FROM:TO:COUNT with factors above 0 and a count from 1 "
            f"to {MAX_POINTS}, such as controller.K_r=0.01:1:41"
        )
    return along


def checked_along(configs: "Mapping[Path, Config]", texts: tuple[str, ...]) -> list[Along]:
    """Return the values of --along, before anything is computed.

    If a config has no numbers at one of the keys, print all problems and end the command with exit
    code 2.

    Raises:
        UsageError: A text does not have the form KEY=FROM:TO:COUNT.
    """
    from rbstab.config.errors import ConfigError
    from rbstab.experiment.locus import check_key
    from rbstab_cli.arguments.configs import exit_on_problems

    alongs = [parse_along(text) for text in texts]
    problems: dict[str, None] = {}
    for config in configs.values():
        for along in alongs:
            try:
                check_key(config, along.key)
            except ConfigError as error:
                problems.update(dict.fromkeys(str(problem) for problem in error.problems))
    exit_on_problems(problems)
    return alongs


def locus_points(config: "Config", along: Along) -> "list[LocusPoint]":
    """Compute the root locus of a config along a gain that it has.

    Raises:
        UsageError: A scaled config is not valid.
    """
    import numpy as np

    from rbstab.config.errors import ConfigError
    from rbstab.experiment.locus import root_locus

    factors = np.geomspace(along.start, along.end, along.points)
    try:
        return root_locus(config, along.key, factors)
    except ConfigError as error:
        raise click.UsageError(f"--along: {error}") from error
