"""Compute the `run_id` of many members at once, without making their configs.

The canonical text that `run_id` hashes differs between the members of a variant only at the varied
numbers and in the title. So the text is made once, and filled in for each member.
"""

import hashlib
import json
import re
from itertools import chain, repeat
from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from rbstab.config.load import identifying, run_id
from rbstab.config.numbers import numbers_below, replaced
from rbstab.mechanics.numbers import Array
from rbstab.sweep.plan.axes import VARIANT
from rbstab.sweep.plan.plan import Plan

ID_LENGTH = 32
"""Hexadecimal digits of a `run_id`."""

_TEMPLATES: "WeakKeyDictionary[Plan, dict[str, _TextTemplate | None]]" = WeakKeyDictionary()
"""Cached templates, by plan and variant. Making one takes as long as integrating 100 members."""


class _VariedNumber(NamedTuple):
    """A varied number of the config.

    Args:
        key: The varied key.
        factor: What a value of the key times is the number (`VariedKey.factor`).
    """

    key: str
    factor: float


class _TextTemplate(NamedTuple):
    """The canonical text of the members of a variant, for `_fill`.

    Args:
        head: The text before the first varied number.
        constants: The texts after each varied number, and after the title, which comes last.
        numbers: The varied numbers, in the order of the text.
    """

    head: str
    constants: tuple[str, ...]
    numbers: tuple[_VariedNumber, ...]


def run_ids(plan: Plan, start: int, stop: int) -> Array:
    """Return the identities of members, equal to `run_id(plan.config_of(i))`.

    Args:
        plan: The plan.
        start: The first member.
        stop: One after the last member, as in `range`.

    Returns:
        Shape (stop - start,), bytes of 32 hexadecimal digits.
    """
    found = np.empty(stop - start, dtype=f"S{ID_LENGTH}")
    values = plan.values(start, stop)
    names = values.get(".".join(map(str, VARIANT)))
    for variant in plan.variants:
        inside = np.arange(stop - start) if names is None else np.flatnonzero(names == variant)
        if not len(inside):
            continue
        chosen = {key: entries[inside] for key, entries in values.items()}
        template = _cached_template(plan, variant, start + int(inside[0]))
        if template is None:
            found[inside] = [_run_id_of(plan, start + index) for index in inside.tolist()]
        else:
            found[inside] = _fill(plan, variant, template, start + inside, chosen)
    return found


def _cached_template(plan: Plan, variant: str, member: int) -> _TextTemplate | None:
    """Return the template of a variant, verified with one member; None if there is none."""
    templates = _TEMPLATES.setdefault(plan, {})
    if variant not in templates:
        template = _template(plan, variant)
        if template is not None:
            members, values = np.array([member]), plan.values(member, member + 1)
            if _fill(plan, variant, template, members, values)[0] != _run_id_of(plan, member):
                # No known plan fails this check. If one does, its identities are computed slowly.
                template = None
        templates[variant] = template
    return templates[variant]


def _run_id_of(plan: Plan, member: int) -> bytes:
    return run_id(plan.config_of(member)).encode()


def _template(plan: Plan, variant: str) -> _TextTemplate | None:
    """Make the template of a variant; None if anything other than a float varies."""
    data: dict[str, Any] = json.loads(json.dumps(identifying(plan.base_of(variant))))
    numbers: list[_VariedNumber] = []
    for varied in plan.varied_keys_of(variant):
        for path, value in list(numbers_below(data, varied.path)):
            if not isinstance(value, float):
                return None
            # The mark is unique, because no text of a config has a null character.
            data = replaced(data, {path: f"\0{len(numbers)}"})
            numbers.append(_VariedNumber(varied.key, varied.factor(value)))
    data["title"] = "\0title"
    pieces = re.split(r'"\\u0000(\w+)"', _canonical(data))
    constants, names = pieces[::2], pieces[1::2]
    if names[-1] != "title":
        return None
    varied_numbers = tuple(numbers[int(name)] for name in names[:-1])
    return _TextTemplate(constants[0], tuple(constants[1:]), varied_numbers)


def _fill(
    plan: Plan, variant: str, template: _TextTemplate, members: Array, values: dict[str, Array]
) -> Array:
    """Return the identities of some members of a variant."""
    filled = []
    for key, factor in template.numbers:
        # -0.0 becomes 0.0, as in a config.
        filled.append(list(map(repr, (values[key] * factor + 0.0).tolist())))
    filled.append(_titles(plan, variant, members))
    # The columns of all texts, varied and constant ones in turn: joined faster than formatted.
    constants = map(repeat, template.constants)
    columns = chain.from_iterable(zip(filled, constants, strict=True))
    head, digests = hashlib.sha256(template.head.encode()), []
    for text in map("".join, zip(*columns, strict=False)):
        digest = head.copy()
        digest.update(text.encode())
        digests.append(digest.digest()[: ID_LENGTH // 2])
    # All digits at once: one by one they take as long as the digests.
    return np.frombuffer(b"".join(digests).hex().encode(), dtype=f"S{ID_LENGTH}")


def _titles(plan: Plan, variant: str, members: Array) -> list[str]:
    """Return the titles of some members as JSON; each ends with the number of the member."""
    texts = list(map(str, members.tolist()))
    # The prefix depends on the length of the number, because long titles are cut.
    prefixes = {
        length: json.dumps(plan.title_of(variant, 10 ** (length - 1)))[: -length - 1]
        for length in set(map(len, texts))
    }
    return [f'{prefixes[len(text)]}{text}"' for text in texts]


def _canonical(data: Any) -> str:
    return json.dumps(data, sort_keys=True, separators=(",", ":"))
