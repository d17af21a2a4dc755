"""Scaling of the gains that a tuning may change."""

from collections.abc import Iterable
from typing import NamedTuple

from rbstab.config.elements import declarations_of, parameter_path
from rbstab.config.errors import closest_keys, did_you_mean
from rbstab.config.numbers import Entry, controller_gains, entries_under, value_at
from rbstab.config.schema import Config
from rbstab.config.source import Path, key_of
from rbstab.config.units import number_key
from rbstab.elements.declarations import ANCHOR, POINT


class TuningError(ValueError):
    """A key is not a gain that can be scaled, or two keys include the same number."""


class GainScaling(NamedTuple):
    """A gain matrix, or one entry of a diagonal matrix, that is multiplied by one factor.

    key is its name, and entries are its numbers. A positive factor keeps a matrix positive
    definite. A change of one entry of a full matrix may not.
    """

    key: str
    entries: tuple[Entry, ...]


def gain_scalings(config: Config, keys: Iterable[str]) -> tuple[GainScaling, ...]:
    """Return the scaling of each key, such as `controller.L_c` or `controller.L_c[0]`.

    Raises:
        TuningError: A key is not a gain of this config, is one entry of a full matrix, or includes
            a number of another key.
    """
    scalings: list[GainScaling] = []
    taken: dict[Path, str] = {}
    for key in keys:
        scalings.append(GainScaling(key, _entries(config, key)))
        for place in (place for entry in scalings[-1].entries for place in entry.paths):
            if taken.setdefault(place, key) != key:
                raise TuningError(f"{key}: {key_of(place)} is scaled by {taken[place]} already")
    if not scalings:
        raise TuningError("no gain to tune (expected a key such as controller.L_r)")
    return tuple(scalings)


def _entries(config: Config, key: str) -> tuple[Entry, ...]:
    read = number_key(key)
    path = read.path if read is not None else ()
    gain_paths = controller_gains(config)
    for name, section in config.elements.items():
        declared = declarations_of(section).gains
        scaled = [
            gain for gain in declared if gain not in (POINT, ANCHOR) and gain.shape != "direction"
        ]
        gain_paths += [parameter_path(name, section, gain.place) for gain in scaled]
    gain_path = next((gain for gain in gain_paths if path[: len(gain)] == gain), None)
    if gain_path is None:
        names = [key_of(gain) for gain in gain_paths]
        meant = closest_keys(key.partition("[")[0], names)
        question = f"; {did_you_mean(meant)}" if meant else ""
        expected = f"expected one of {', '.join(names)}{question}"
        raise TuningError(f"{key}: is not a gain of this config ({expected})")
    value = value_at(config, gain_path)
    if len(path) > len(gain_path) and isinstance(value, tuple) and isinstance(value[0], tuple):
        raise TuningError(
            f"{key}: is one entry of a full matrix, which might not stay positive definite "
            f"(expected {key_of(gain_path)})"
        )
    try:
        entries = entries_under(config, path)
    except LookupError:
        expected = f"expected {key_of(gain_path)} or one of its three entries, from [0]"
        raise TuningError(f"{key}: does not exist ({expected})") from None
    if not any(entry.value for entry in entries):
        raise TuningError(f"{key}: is 0, so no factor changes it (expected a gain above 0)")
    return entries
