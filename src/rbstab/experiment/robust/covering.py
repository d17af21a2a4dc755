"""Members of a sweep that lie inside the box of a stored proof for all bodies within tolerances."""

import math
from collections.abc import Iterable, Mapping
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from rbstab.config.entries import is_of_initial_state
from rbstab.config.errors import ConfigError, Location
from rbstab.config.load import resolved, validated
from rbstab.config.schema import Config
from rbstab.config.source import Path as KeyPath
from rbstab.config.source import Source, key_of
from rbstab.experiment.robust.bodies import bodies_id, sections_of
from rbstab.experiment.robust.cache import all_bodies
from rbstab.experiment.robust.record import BodiesRecord
from rbstab.mechanics.numbers import Array


def valid_proofs(folder: Path, config: Config) -> list[BodiesRecord]:
    """Return the stored proofs that give levels of bodies like that of a config.

    Args:
        folder: The folder of results.
        config: The config; its numbers may differ from those of a proof.

    Raises:
        StoreError: The disk reports an error.
    """
    return [
        record
        for record in all_bodies(folder)
        if record.proved and record.level > 0 and _is_valid(record, config)
    ]


def levels_of(
    records: Iterable[BodiesRecord], config: Config, varied: Mapping[Any, Array], count: int
) -> Array:
    """Return the highest level, J, that some proofs give for each of some members, (count,).

    Each motion of a member with v(0) below its level converges to its only rest state. The level is
    0 where no proof has the member's body, gravity and controller in its box. The comparison is one
    of exact decimals.

    Args:
        records: The proofs, from `valid_proofs`.
        config: The config of the members, but for the varied numbers.
        varied: The values of the varied numbers by path, such as `("controller", "K_r", 0)`, each
            of shape (count,). Numbers of other sections than body, gravity and controller have no
            effect. The numbers of a symmetric matrix are needed at both places.
        count: The number of members.
    """
    levels = np.zeros(count)
    for record in records:
        inside = covered(record, config, varied, count)
        levels = np.where(inside, np.maximum(levels, record.level), levels)
    return levels


def covered(record: BodiesRecord, config: Config, varied: Mapping[Any, Array], count: int) -> Array:
    """Return whether each member lies inside the box of a proof, shape (count,)."""
    inside = np.ones(count, dtype=bool)
    numbers, settings = _leaves(sections_of(config))
    middle, own_settings = _leaves(record.sections)
    if settings != own_settings or numbers.keys() != middle.keys():
        return ~inside
    bounds = _bounds_by_path(record, middle)
    for path, value in numbers.items():
        low, high = bounds[path]
        values = np.asarray(varied.get(path, np.full(count, value)), dtype=float)
        inside &= (values >= _least_double(low)) & (values <= -_least_double(-high))
    acting = (path for path in varied if not is_of_initial_state(path))
    known = {path for path in acting if path[0] in record.sections}
    return inside if known <= numbers.keys() else np.zeros(count, dtype=bool)


def _is_valid(record: BodiesRecord, config: Config) -> bool:
    """Return whether a proof belongs to the equations of this version, by its id."""
    data = resolved(config)
    if record.sections["controller"].get("variant") != data["controller"]["variant"]:
        return False
    data.update(record.sections)
    try:
        middle = validated(Source(data, {(): Location("proof")}))
    except ConfigError:
        return False
    return bodies_id(middle, record.tolerances) == record.id


def _leaves(value: Any, path: KeyPath = ()) -> tuple[dict[KeyPath, float], dict[KeyPath, Any]]:
    """Return the numbers of plain data by path, and everything else."""
    if isinstance(value, dict):
        children = [((*path, name), entry) for name, entry in value.items()]
    elif isinstance(value, list | tuple):
        children = [((*path, index), entry) for index, entry in enumerate(value)]
    elif isinstance(value, float | int) and not isinstance(value, bool):
        return {path: float(value)}, {}
    else:
        return {}, {path: value}
    numbers: dict[KeyPath, float] = {}
    others: dict[KeyPath, Any] = {}
    for own_path, entry in children:
        own_numbers, own_others = _leaves(entry, own_path)
        numbers |= own_numbers
        others |= own_others
    return numbers, others


def _bounds_by_path(
    record: BodiesRecord, middle: Mapping[KeyPath, float]
) -> dict[KeyPath, tuple[Fraction, Fraction]]:
    """Return the bounds of each number; those of an entry of a matrix hold for its mirror image."""
    by_key = {one.key: (Fraction(one.low), Fraction(one.high)) for one in record.tolerances}
    found = {}
    for path, value in middle.items():
        exact = Fraction(repr(value))
        mirrored = path
        if len(path) > 1 and isinstance(path[-1], int) and isinstance(path[-2], int):
            mirrored = (*path[:-2], min(path[-2:]), max(path[-2:]))
        found[path] = by_key.get(key_of(mirrored), (exact, exact))
    return found


def _least_double(bound: Fraction) -> float:
    """Return the least double that means a decimal of at least `bound`.

    The decimal that a double means grows with the double, so comparing doubles is exact.
    """
    value = float(bound)
    while Fraction(repr(value)) < bound:
        value = math.nextafter(value, math.inf)
    while Fraction(repr(below := math.nextafter(value, -math.inf))) >= bound:
        value = below
    return value
