"""The identities of many members at once: `run_id` of their configs, without making the configs.

Between the members of a variant, the canonical text that `run_id` hashes differs at the varied
numbers and in the title alone. So it is made once and filled in for each member.
"""

import hashlib
import json
import re
from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from rbstab.config.load import resolved, run_id
from rbstab.config.source import Path
from rbstab.mechanics.numbers import Array
from rbstab.sweep.plan.axes import VARIANT, at
from rbstab.sweep.plan.plan import Plan

DIGITS = 32
"""Of an identity."""

_FORMS: "WeakKeyDictionary[Plan, dict[str, _Form | None]]" = WeakKeyDictionary()
"""The forms of plans by variant: to make one takes as long as to follow a hundred members."""


class _Leaf(NamedTuple):
    """A number that varies: its column, and what is multiplied by the column's value (or None)."""

    key: str
    factor: float | None


class _Form(NamedTuple):
    """The canonical text of a variant's members, with a `%` where something varies; see `_fill`.

    head is what stands before the first of these.
    """

    head: str
    text: str
    leaves: tuple[_Leaf, ...]


def run_ids(plan: Plan, start: int, stop: int) -> Array:
    """The identities of members as single runs, as `run_id(plan.config_of(i))` gives them.

    Args:
        plan: The plan.
        start: The first member.
        stop: Behind the last one.

    Returns:
        Shape (stop - start,), bytes of 32 hexadecimal digits.
    """
    found = np.empty(stop - start, dtype=f"S{DIGITS}")
    values = plan.values(start, stop)
    names = values.get(".".join(map(str, VARIANT)))
    for variant in plan.variants:
        inside = np.arange(stop - start) if names is None else np.flatnonzero(names == variant)
        if not len(inside):
            continue
        chosen = {key: column[inside] for key, column in values.items()}
        form = _known_form(plan, variant, start + int(inside[0]))
        if form is None:
            found[inside] = [_slow(plan, start + index) for index in inside.tolist()]
        else:
            found[inside] = _fill(plan, variant, form, start + inside, chosen)
    return found


def _known_form(plan: Plan, variant: str, member: int) -> _Form | None:
    """The form of a variant's members, made once and tried on one of them; None: there is none."""
    forms = _FORMS.setdefault(plan, {})
    if variant not in forms:
        form = _form(plan, variant)
        if form is not None:
            numbers, values = np.array([member]), plan.values(member, member + 1)
            if _fill(plan, variant, form, numbers, values) != [_slow(plan, member)]:
                # No plan is known to come here; a wrong identity would be worse than a slow one.
                form = None
        forms[variant] = form
    return forms[variant]


def _slow(plan: Plan, index: int) -> bytes:
    return run_id(plan.config_of(index)).encode()


def _form(plan: Plan, variant: str) -> _Form | None:
    """The form of a variant's members; None where something other than a float varies."""
    data: dict[str, Any] = json.loads(json.dumps(resolved(plan.base_of(variant))))
    leaves: list[_Leaf] = []
    for column in plan.columns_of(variant):
        for path in _numbers_at(column.path, at(data, column.path)):
            value = at(data, path)
            if not isinstance(value, float):
                return None
            # No text of a config has a null character.
            at(data, path[:-1])[path[-1]] = f"\0{len(leaves)}"
            leaves.append(_Leaf(column.key, value if column.scale else None))
    data["title"] = "\0title"
    pieces = re.split(r'"\\u0000(\w+)"', _canonical(data))
    constants, names = [piece.replace("%", "%%") for piece in pieces[::2]], pieces[1::2]
    marks = ["%s" if name == "title" else "%r" for name in names]
    text = "".join(mark + c for mark, c in zip(marks, constants[1:], strict=True))
    if names[-1] != "title":
        return None
    return _Form(pieces[0], text, tuple(leaves[int(name)] for name in names[:-1]))


def _numbers_at(path: Path, value: Any) -> list[Path]:
    if not isinstance(value, list):
        return [path]
    return [leaf for i, entry in enumerate(value) for leaf in _numbers_at((*path, i), entry)]


def _fill(
    plan: Plan, variant: str, form: _Form, numbers: Array, values: dict[str, Array]
) -> list[bytes]:
    """The identities of some members of a variant."""
    filled = []
    for key, factor in form.leaves:
        value = values[key] if factor is None else values[key] * factor
        # As a config does with -0.0.
        filled.append((value + 0.0).tolist())
    titles = _titles(plan, variant, numbers)
    begun, text, found = hashlib.sha256(form.head.encode()), form.text, []
    for row in zip(*filled, titles, strict=True):
        digest = begun.copy()
        digest.update((text % row).encode())
        found.append(digest.hexdigest()[:DIGITS].encode())
    return found


def _titles(plan: Plan, variant: str, numbers: Array) -> list[str]:
    """The titles of some members as JSON, which ends with the number of the member."""
    found, leads = [], {}
    for text in map(str, numbers.tolist()):
        # What stands before the number depends on its length, for a title is not too long.
        if len(text) not in leads:
            leads[len(text)] = json.dumps(plan.title_of(variant, int(text)))[: -len(text) - 1]
        found.append(f'{leads[len(text)]}{text}"')
    return found


def _canonical(data: Any) -> str:
    return json.dumps(data, sort_keys=True, separators=(",", ":"))
