"""Tables of the config keys that differ between runs, and of the keys that are equal."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, TypeGuard

from rbstab.config.units import Kind, unit_of
from rbstab.elements.registry import SELECTORS
from rbstab.report.model.document import Block, Cell, Head, Section, Table
from rbstab.report.model.words import NO_VALUE, counted, number, untrusted
from rbstab.report.runs.facts import RunFacts

MAX_LISTED = 24
"""The most entries of a list that are shown."""

MAX_KEYS = 12
"""Maximum number of keys that differ, each with a column."""

OMITTED_KEYS = ("schema_version", "reference")
"""Keys that do not describe the experiment."""

TIMES = ("integration.duration", "integration.time_limit")
"""Keys in s. They are no part of `unit_of`, which also names the units of columns of sweeps: those
are stored, and stay as they are."""

Flat = dict[str, Any]


def differences_section(facts: Sequence[RunFacts]) -> Section | None:
    """Return the section with the keys in which runs differ; None for one run, or no config."""
    configs = _configs(facts)
    if len(facts) < 2 or not configs:
        return None
    keys = _keys(configs.values(), differing=True)
    block: Block = "The configs of all runs are equal."
    if keys:
        heads = [Head(untrusted(key), _unit(key, configs)) for key in keys[:MAX_KEYS]]
        rows = tuple(
            (Cell(label), *(_cell(config.get(key)) for key in keys[:MAX_KEYS]))
            for label, config in configs.items()
        )
        omitted = len(keys[MAX_KEYS:])
        note = f"Not shown: {counted(omitted, 'more differing key')}." if omitted else ""
        block = Table("differences", "Keys that differ", (Head("run"), *heads), rows, note)
    return Section("differences", "Differences between the runs", (block,))


def config_section(facts: Sequence[RunFacts]) -> Section | None:
    """Return the section with the keys that are equal in all runs; None if there are none."""
    configs = _configs(facts)
    keys = _keys(configs.values(), differing=False)
    blocks: list[Block] = []
    if keys:
        first = next(iter(configs.values()))
        rows = tuple((Cell(with_unit(key, configs)), _cell(first.get(key))) for key in keys)
        title = "The resolved config" if len(facts) == 1 else "Equal in all runs"
        blocks.append(Table("equal", title, (Head("key"), Head("value")), rows))
    if len(configs) < len(facts):
        unread = counted(len(facts) - len(configs), "run")
        blocks.append(f"Not shown: {unread} with an unreadable config.")
    return Section("config", "Config", tuple(blocks), folded=True) if blocks else None


def _configs(facts: Sequence[RunFacts]) -> dict[str, Flat]:
    return {entry.run.label: flat(entry.run.data) for entry in facts if entry.run.data}


def _keys(configs: Iterable[Flat], *, differing: bool) -> list[str]:
    """Return the keys in which configs differ, or those in which they are equal."""
    every = list(configs)
    keys = dict.fromkeys(key for config in every for key in config if _is_shown(key))
    return [key for key in keys if _differs(key, every) == differing]


def flat(data: Mapping[str, Any], prefix: str = "") -> Flat:
    """Return the values of a config by dotted key, as on the command line; a list is one value."""
    values: Flat = {}
    for key, value in data.items():
        if not prefix and key in OMITTED_KEYS:
            continue
        name = f"{prefix}{key}"
        values |= flat(value, f"{name}.") if isinstance(value, dict) else {name: value}
    return values


def _is_shown(key: str) -> bool:
    """Whether a key has a row: the text of a user's file has its SHA-256 instead."""
    parts = key.split(".")
    return not (len(parts) == 3 and parts[0] == "elements" and parts[2] == "source")


def _differs(key: str, configs: Sequence[Flat]) -> bool:
    first = configs[0].get(key)
    return any(config.get(key) != first for config in configs)


def _unit(key: str, configs: Mapping[str, Flat]) -> str:
    """Return the unit of a key; that of an element depends on its kind."""
    if key in TIMES:
        return "s"
    element = ".".join(key.split(".")[:2])
    found = {_kind(config, element) for config in configs.values() if f"{element}.kind" in config}
    return unit_of(key, found)


def _kind(config: Flat, element: str) -> Kind:
    """Return what decides the units of an element, such as `elements.strut`."""
    kind = str(config[f"{element}.kind"])
    others = (SELECTORS.get(kind, ""), "source", "class")
    return Kind(kind, *(_text_or_none(config.get(f"{element}.{part}")) for part in others))


def _text_or_none(value: object) -> str | None:
    return None if value is None else str(value)


def with_unit(key: str, configs: Mapping[str, Flat]) -> str:
    """Return a key with its unit, for a table of configs."""
    unit = _unit(key, configs)
    return untrusted(f"{key} [{unit}]" if unit not in ("", "1") else key)


def _is_number(value: object) -> TypeGuard[int | float]:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _cell(value: object) -> Cell:
    return Cell(value_text(value), float(value)) if _is_number(value) else Cell(value_text(value))


def value_text(value: object) -> str:
    """Return a value of a config as text that is safe to print; `NO_VALUE` for None."""
    if _is_number(value):
        return number(value, 12)
    return NO_VALUE if value is None else untrusted(_text(value))


def _text(value: object) -> str:
    """Return a config value as text; only the ends of a long list, as of a table of an input."""
    if isinstance(value, list) and len(value) > MAX_LISTED:
        first, last = (
            ", ".join(_text(entry) for entry in ends) for ends in (value[:3], value[-3:])
        )
        return f"[{first}, ..., {last}] ({len(value)} entries)"
    if isinstance(value, list):
        return f"[{', '.join(_text(entry) for entry in value)}]"
    return number(value, 12) if isinstance(value, float) else str(value)
