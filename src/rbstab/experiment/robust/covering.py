"""Members of a sweep that lie inside the box of a stored proof for all bodies within tolerances."""

import math
from collections.abc import Iterable, Iterator, Mapping
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
from rbstab.experiment.robust.bodies import all_bodies, bodies_id
from rbstab.experiment.robust.record import BodiesRecord
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


def member_claims(
    records: Iterable[BodiesRecord], config: Config, varied: Mapping[Any, Array], count: int
) -> tuple[Array, Array]:
    """Return what some proofs say of each of some members, by comparing exact decimals.

    Args:
        records: The proofs, from `valid_proofs`.
        config: The config of the members, but for the varied numbers.
        varied: The values of the varied numbers by path, such as `("controller", "K_r", 0)`, each
            of shape (count,). Numbers of other sections than body, gravity and controller have no
            effect. The numbers of a symmetric matrix are needed at both places.
        count: The number of members.

    Returns:
        The highest level, J, shape (count,): each motion of a member with v(0) below it converges
        to its only rest state. It is 0 where no proof has the member's body, gravity and controller
        in its box. And 1 where a proof shows that the member has one rest state, a minimum, 2 where
        its body is that of a counterexample, and else 0, shape (count,).
    """
    levels, codes = np.zeros(count), np.zeros(count, dtype=np.int8)
    for record in sorted(records, key=lambda proof: proof.proved is False):
        compared = _compared(record, config, varied)
        inside = np.full(count, compared is not None)
        for values, low, high in compared or ():
            inside &= (values >= _least_double(low)) & (values <= -_least_double(-high))
        levels[inside] = np.maximum(levels[inside], record.level)
        codes[inside] = 1 if record.proved else 2
    return levels, codes


def counterexample_between(
    records: Iterable[BodiesRecord], config: Config, varied: Mapping[Any, Array]
) -> BodiesRecord | None:
    """Return a counterexample between the least and the greatest of each varied number, or None.

    Of several, it is that of the widest box: it stays the same when parts of the box are examined.

    Args:
        records: The proofs, from `valid_proofs`.
        config: The config of the members, but for the varied numbers.
        varied: The values of the varied numbers by path, each of shape (members,); see
            `member_claims`.
    """

    def width(record: BodiesRecord) -> Fraction:
        ends = (
            (Fraction(tolerance.low), Fraction(tolerance.high)) for tolerance in record.tolerances
        )
        return sum((high - low for low, high in ends), Fraction(0))

    def lies_between(record: BodiesRecord) -> bool:
        compared = _compared(record, config, varied)
        return compared is not None and all(
            values.max() >= _least_double(number) and values.min() <= -_least_double(-number)
            for values, number, _ in compared
        )

    false = (record for record in records if record.proved is False and lies_between(record))
    return max(false, key=width, default=None)


def _compared(
    record: BodiesRecord, config: Config, varied: Mapping[Any, Array]
) -> list[tuple[Array, Fraction, Fraction]] | None:
    """Return members' numbers beside their bounds in a proof; None if anything else differs."""
    # The bounds are those of the box, or the numbers of the body of a counterexample.
    box = {
        tolerance.key: (Fraction(tolerance.low), Fraction(tolerance.high))
        for tolerance in record.tolerances
    }
    box |= {key: (Fraction(number),) * 2 for key, number in (record.body or {}).items()}
    leaves, others = dict(_leaves(record.sections)), dict(_leaves(acting_sections(config)))
    acting = {
        path for path in varied if path[0] in record.sections and not is_of_initial_state(path)
    }
    if leaves.keys() != others.keys() or not acting <= leaves.keys():
        return None
    compared = []
    for path, middle in leaves.items():
        if not isinstance(middle, float) or not isinstance(others[path], float):
            if middle != others[path]:
                return None
            continue
        # The bounds of an entry of a matrix hold for its mirror image.
        is_entry = all(isinstance(part, int) for part in path[-2:])
        mirrored = (*path[:-2], *sorted(path[-2:])) if is_entry else path
        exact = Fraction(repr(middle))
        values = np.asarray(varied.get(path, others[path]), dtype=float)
        compared.append((values, *box.get(key_of(mirrored), (exact, exact))))
    return compared


def _leaves(value: Any, path: KeyPath = ()) -> Iterator[tuple[KeyPath, Any]]:
    """Yield all values of plain data by their paths, numbers as doubles."""
    if isinstance(value, dict | list | tuple):
        items = value.items() if isinstance(value, dict) else enumerate(value)
        for name, entry in items:
            yield from _leaves(entry, (*path, name))
    else:
        is_number = isinstance(value, float | int) and not isinstance(value, bool)
        yield path, float(value) if is_number else value


def _is_valid(record: BodiesRecord, config: Config) -> bool:
    """Return whether a proof belongs to the equations of this version, by its id."""
    data = resolved(config)
    if record.sections["controller"].get("variant") != data["controller"]["variant"]:
        return False
    try:
        middle = validated(Source(data | record.sections, {(): Location("proof")}))
    except ConfigError:
        return False
    return bodies_id(middle, record.tolerances) == record.id


def _least_double(bound: Fraction) -> float:
    """Return the least double that means a decimal of at least `bound`."""
    # The decimal that a double means grows with the double, so comparing doubles is exact.
    value = float(bound)  # the nearest: only the decimal of this one may be on either side
    return value if Fraction(repr(value)) >= bound else math.nextafter(value, math.inf)
