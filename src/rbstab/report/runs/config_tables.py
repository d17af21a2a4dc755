"""In what the configs of runs differ, and in what they do not."""

import json
from collections.abc import Mapping, Sequence
from typing import Any, TypeGuard

from rbstab.report.model.document import Block, Cell, Head, Section, Table
from rbstab.report.model.words import NOTHING, counted, number, untrusted
from rbstab.report.runs.facts import RunFacts
from rbstab.sweep.folder.layout import UNITS

MAX_SIDE_BY_SIDE = 6
"""Runs with a column each; of more, a run has a row."""

MAX_KEYS = 12
"""Columns of that other table."""

LEFT_OUT = ("schema_version", "reference")
"""Keys that are nothing of the experiment."""

Flat = dict[str, Any]


def config_section(facts: Sequence[RunFacts]) -> Section | None:
    """What differs, then what is equal; None where no config can be read."""
    configs = {one.run.label: _flat(one.run.data) for one in facts if one.run.data}
    if not configs:
        return None
    keys = list(dict.fromkeys(key for config in configs.values() for key in config))
    differing = [key for key in keys if _differs(key, list(configs.values()))]
    equal = [key for key in keys if key not in differing]
    blocks: list[Block] = []
    if len(configs) == 1:
        title = "The experiment"
    else:
        title = "What differs between the runs"
        blocks += _differences(configs, differing)
    if equal:
        first = next(iter(configs.values()))
        rows = tuple((Cell(_named(key)), _cell(first.get(key))) for key in equal)
        what = "The resolved config" if len(configs) == 1 else "Equal in all runs"
        blocks.append(Table("equal", what, (Head("key"), Head("value")), rows))
    if len(configs) < len(facts):
        blocks.append(
            f"{counted(len(facts) - len(configs), 'run')} with a config that cannot be read."
        )
    return Section("differences", title, tuple(blocks))


def _differences(configs: Mapping[str, Flat], keys: Sequence[str]) -> list[Block]:
    if not keys:
        return ["The configs of all runs say the same."]
    if len(configs) <= MAX_SIDE_BY_SIDE:
        rows = tuple(
            (Cell(_named(key)), *(_cell(config.get(key)) for config in configs.values()))
            for key in keys
        )
        heads = (Head("key"), *(Head(label) for label in configs))
        return [Table("differences", "One row for each key that differs", heads, rows)]
    shown = keys[:MAX_KEYS]
    return [_extent(configs, keys), _by_run(configs, shown, left_out=len(keys) - len(shown))]


def _extent(configs: Mapping[str, Flat], keys: Sequence[str]) -> Table:
    """How far each key varies."""
    heads = (Head("key"), Head("values", numbers=True), Head("smallest"), Head("largest"))
    rows = []
    for key in keys:
        values = [config.get(key) for config in configs.values()]
        numbers = [float(value) for value in values if _is_number(value)]
        whole = len(numbers) == len(values)
        ends = (min(numbers), max(numbers)) if whole else (None, None)
        count = len({json.dumps(value, default=str) for value in values})
        rows.append((Cell(_named(key)), Cell(str(count), float(count)), *map(_cell, ends)))
    return Table("varied", "Keys that differ, and how far", heads, tuple(rows))


def _by_run(configs: Mapping[str, Flat], keys: Sequence[str], left_out: int) -> Table:
    heads = (
        Head("run"),
        *(Head(untrusted(key), UNITS.get(key, ""), _numeric(key, configs)) for key in keys),
    )
    rows = tuple(
        (Cell(label), *(_cell(config.get(key)) for key in keys))
        for label, config in configs.items()
    )
    note = f"{counted(left_out, 'more key')} that differ are not shown here." if left_out else ""
    return Table("differences", "One row for each run", heads, rows, note)


def _numeric(key: str, configs: Mapping[str, Flat]) -> bool:
    return all(_is_number(config.get(key)) for config in configs.values())


def _flat(data: Mapping[str, Any], lead: str = "") -> Flat:
    """Keys from the root, as on the command line; a list is one value."""
    found: Flat = {}
    for key, value in data.items():
        if not lead and key in LEFT_OUT:
            continue
        name = f"{lead}{key}"
        found |= _flat(value, f"{name}.") if isinstance(value, dict) else {name: value}
    return found


def _differs(key: str, configs: Sequence[Flat]) -> bool:
    first = configs[0].get(key)
    return any(config.get(key) != first for config in configs)


def _named(key: str) -> str:
    unit = UNITS.get(key, "")
    return untrusted(f"{key} [{unit}]" if unit else key)


def _is_number(value: object) -> TypeGuard[int | float]:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _cell(value: object) -> Cell:
    if _is_number(value):
        return Cell(number(value, 12), float(value))
    return Cell(NOTHING if value is None else untrusted(_words(value)))


def _words(value: object) -> str:
    """A value of a config as it is written there."""
    if isinstance(value, list):
        return f"[{', '.join(_words(entry) for entry in value)}]"
    return number(value, 12) if isinstance(value, float) else str(value)
