"""The gains that a tuning may scale."""

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

from rbstab.config.entries import GAINS, Entry, entries_under, value_at
from rbstab.config.load import load_config, resolved
from rbstab.config.overrides import parse_key
from rbstab.config.schema import Config
from rbstab.config.source import Path, key_of

MAX_TITLE_LENGTH = 200


class DesignError(ValueError):
    """What is to be tuned is no gain of the config, or stands there twice."""


class Design(NamedTuple):
    """A gain matrix, or an entry of a diagonal one, that is scaled by one factor.

    A positive factor keeps a matrix positive definite, which a change of a single entry of a full
    one does not.
    """

    key: str
    entries: tuple[Entry, ...]


def designs_of(config: Config, keys: Iterable[str]) -> tuple[Design, ...]:
    """The designs that keys such as `controller.L_c` or `controller.L_c[0]` name.

    Raises:
        DesignError: A key names no gain of this config, one entry of a full matrix, or a number
            that another key names too.
    """
    designs: list[Design] = []
    taken: dict[Path, str] = {}
    for key in keys:
        design = Design(key, _entries(config, key))
        for place in (place for entry in design.entries for place in entry.places):
            if place in taken:
                raise DesignError(f"{key}: has {key_of(place)} in common with {taken[place]}")
            taken[place] = key
        designs.append(design)
    if not designs:
        raise DesignError("nothing is to be tuned (expected a key such as controller.L_r)")
    return tuple(designs)


def _entries(config: Config, key: str) -> tuple[Entry, ...]:
    path = parse_key(key) or ()
    gains = [name for name in GAINS if hasattr(config.controller, name)]
    known = [("controller", name) for name in gains]
    if path[:2] not in known:
        expected = ", ".join(key_of(gain) for gain in known)
        raise DesignError(f"{key}: is no gain of this config (expected one of {expected})")
    if len(path) > 2 and isinstance(value_at(config, path[:2])[0], tuple):
        raise DesignError(
            f"{key}: is a part of a full matrix, which may not stay positive definite "
            f"(expected {key_of(path[:2])})"
        )
    try:
        return entries_under(config, path)
    except LookupError:
        expected = f"expected {key_of(path[:2])} or one of its three entries, from [0]"
        raise DesignError(f"{key}: leads nowhere ({expected})") from None


def scaled(config: Config, designs: Sequence[Design], factors: Sequence[float]) -> Config:
    """The config with its designs scaled, validated.

    Raises:
        ConfigError: A scaled gain is none any more, as where it is no finite number.
    """
    data = resolved(config)
    for design, factor in zip(designs, factors, strict=True):
        for entry in design.entries:
            for *above, last in entry.places:
                here: Any = data
                for part in above:
                    here = here[part]
                here[last] = entry.value * factor
    return load_config(data)


def retitled(config: Config, addition: str) -> Config:
    """The config with something added to its title."""
    title = config.title[: MAX_TITLE_LENGTH - len(addition)] + addition
    return load_config({**resolved(config), "title": title})
