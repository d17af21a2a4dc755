"""Members of a sweep that lie inside the box of a stored proof for all bodies within tolerances."""

import math
from collections.abc import Iterable, Mapping
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from rbstab.config.errors import ConfigError, Location
from rbstab.config.load import acting_sections, resolved, validated
from rbstab.config.numbers import is_of_initial_state
from rbstab.config.schema import Config
from rbstab.config.source import Path as KeyPath
from rbstab.config.source import Source, key_of
from rbstab.experiment.robust.bodies import bodies_id
from rbstab.experiment.robust.cache import all_bodies
from rbstab.experiment.robust.record import BodiesRecord, StoredTolerance
from rbstab.mechanics.numbers import Array


def valid_proofs(folder: Path, config: Config) -> list[BodiesRecord]:
    """Return the stored proofs and counterexamples that are about bodies like that of a config.

    Args:
        folder: The folder of results.
        config: The config; its numbers may differ from those of a proof.

    Raises:
        StoreError: The disk reports an error.
    """
    return [
        record
        for record in all_bodies(folder)
        if record.proved is not None and _is_valid(record, config)
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


def one_state_of(
    records: Iterable[BodiesRecord], config: Config, varied: Mapping[Any, Array], count: int
) -> Array:
    """Return whether the body of each member has one rest state, a minimum, shape (count,).

    It is 1 where some proof shows it, -1 where the body is that of a counterexample, and else 0.
    The arguments are those of `levels_of`.
    """
    found = np.zeros(count, dtype=np.int8)
    for record in sorted(records, key=lambda one: one.proved is False):
        if record.proved:
            found[covered(record, config, varied, count)] = 1
        elif record.proved is False:
            found[covered(_body_alone(record), config, varied, count)] = -1
    return found


def counterexample_between(
    records: Iterable[BodiesRecord], config: Config, varied: Mapping[Any, Array]
) -> BodiesRecord | None:
    """Return a counterexample between the least and the greatest of each varied number, or None.

    Of several, it is that of the widest box: it stays the same when parts of the box are examined.
    The arguments are those of `levels_of`.
    """
    for record in sorted(records, key=_width, reverse=True):
        if record.proved is False and _body_lies_between(record, config, varied):
            return record
    return None


def covered(record: BodiesRecord, config: Config, varied: Mapping[Any, Array], count: int) -> Array:
    """Return whether each member lies inside the box of a proof, shape (count,)."""
    inside = np.ones(count, dtype=bool)
    compared = _compared(record, config, varied)
    if compared is None:
        return ~inside
    numbers, bounds = compared
    for path, value in numbers.items():
        low, high = bounds[path]
        values = np.asarray(varied.get(path, value), dtype=float)
        inside &= (values >= _least_double(low)) & (values <= -_least_double(-high))
        if not inside.any():
            break
    return inside


def _body_lies_between(record: BodiesRecord, config: Config, varied: Mapping[Any, Array]) -> bool:
    """Return whether the body of a counterexample is between the ends of all varied numbers."""
    compared = _compared(_body_alone(record), config, varied)
    if compared is None:
        return False
    numbers, bounds = compared
    for path, value in numbers.items():
        values = np.asarray(varied.get(path, value), dtype=float)
        ends = (Fraction(repr(float(end))) for end in (values.min(), values.max()))
        if not next(ends) <= bounds[path][0] <= next(ends):
            return False
    return True


def _width(record: BodiesRecord) -> Fraction:
    """Return the sum of the widths of a box; no part of it has a larger one."""
    ends = ((Fraction(one.low), Fraction(one.high)) for one in record.tolerances)
    return sum((high - low for low, high in ends), Fraction(0))


def _body_alone(record: BodiesRecord) -> BodiesRecord:
    """Return a counterexample with the body that it names as its whole box."""
    body = (record.body or {}).items()
    alone = tuple(StoredTolerance(key=key, low=number, high=number) for key, number in body)
    return record.model_copy(update={"tolerances": alone})


def _compared(
    record: BodiesRecord, config: Config, varied: Mapping[Any, Array]
) -> tuple[dict[KeyPath, float], dict[KeyPath, tuple[Fraction, Fraction]]] | None:
    """Return the numbers of a config, and the bounds of a proof on each; None if others differ."""
    numbers, settings = _leaves(acting_sections(config))
    middle, own_settings = _leaves(record.sections)
    acting = (path for path in varied if not is_of_initial_state(path))
    known = {path for path in acting if path[0] in record.sections}
    if settings != own_settings or numbers.keys() != middle.keys() or not known <= numbers.keys():
        return None
    return numbers, _bounds_by_path(record, middle)


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
