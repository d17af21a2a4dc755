"""Tables of what is equal in all runs and of what differs: keys of configs, and origins."""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeGuard

from rbstab.config.units import unit_of
from rbstab.experiment.answers.rounded import NO_VALUE, number
from rbstab.files.text import chained_commands, shell_word
from rbstab.report.model.document import Block, Cell, Head, Section, Table
from rbstab.report.model.words import counted, untrusted
from rbstab.report.reading.sources import Run

MAX_LISTED = 24
"""The most entries of a list that are shown."""

MAX_KEYS = 12
"""Maximum number of keys that differ, each with a column."""

SOURCE = re.compile(r"elements\.[^.]+\.source")
"""The key of the text of a user's file, which has its SHA-256 in place of a row."""

OMITTED_KEYS = ("schema_version", "reference")
"""Keys that do not describe the experiment."""

TIMES = ("integration.duration", "integration.time_limit")
"""Keys in s. They are no part of `unit_of`, which also names the units of columns of sweeps: those
are stored, and stay as they are."""

SHOWN_ELSEWHERE = ("title", "variant", "status", "status_detail", "verdict", "warnings", "run_id")
"""Attributes that other tables of the report show, or that have another place."""

TITLES = {
    "convergence": "exact motion converges",
    "convergence_rest_state": "it converges to rest state",
    "convergence_time": "it is in a certified region from [s]",
    "convergence_energy_low": "v there, at least [J]",
    "convergence_energy_high": "v there, at most [J]",
    "convergence_bound": "level of that region [J]",
    "convergence_wall_time": "time of the enclosure [s]",
    "wall_time": "wall time [s]",
}
"""Words for attributes whose names do not say what they are."""

UNBOUNDED = "no bound"
"""The level of a region without one: every start converges."""

Flat = dict[str, Any]


def differences_section(runs: Sequence[Run]) -> Section | None:
    """Return the section with the keys in which runs differ; None for one run, or no config."""
    configs = _configs(runs)
    if len(runs) < 2 or not configs:
        return None
    keys = _keys(configs, differing=True)
    block: Block = "The configs of all runs are equal."
    if keys:
        heads = [Head(untrusted(key), _unit(key, configs)) for key in keys[:MAX_KEYS]]
        omitted = len(keys[MAX_KEYS:])
        note = f"Not shown: {counted(omitted, 'more differing key')}." if omitted else ""
        rows = _rows(configs, keys[:MAX_KEYS])
        block = Table.of("differences", "Keys that differ", ("run", *heads), rows, note)
    return Section("differences", "Differences between the runs", (block,))


def config_section(runs: Sequence[Run]) -> Section | None:
    """Return the section with the keys that are equal in all runs; None if there are none."""
    configs = _configs(runs)
    title = "The resolved config" if len(runs) == 1 else "Equal in all runs"
    blocks = _equal("equal", title, configs, "key", lambda key: with_unit(key, configs))
    if len(configs) < len(runs):
        unread = counted(len(runs) - len(configs), "run")
        blocks.append(f"Not shown: {unread} with an unreadable config.")
    return Section("config", "Config", tuple(blocks), folded=True) if blocks else None


def provenance_section(runs: Sequence[Run]) -> Section:
    """Return the section with versions, identities, tolerances, and commands that repeat runs."""
    origins = {run.label: _origin(run) for run in runs}
    title = "Shared by all runs" if len(runs) > 1 else "Origin of the run"
    blocks = _equal("versions", title, origins, "property", str)
    differing = _keys(origins, differing=True)
    if differing:
        rows = _rows(origins, differing)
        blocks.append(Table.of("origins", "Origin of each run", ("run", *differing), rows))
    commands = [(run.label, repeat_command(run)) for run in runs]
    title = "Commands that repeat each run from its stored config"
    blocks.append(Table.of("commands", title, ("run", "command"), commands))
    return Section("provenance", "Provenance", tuple(blocks), folded=True)


def _configs(runs: Sequence[Run]) -> dict[str, Flat]:
    return {run.label: flat(run.data) for run in runs if run.data}


def _origin(run: Run) -> Flat:
    """Return the origin of a run by name: its file, its attributes and integrator settings."""
    origin: Flat = {"file": str(run.path), "run id": run.result.run_id}
    for name, value in run.result.attributes.items():
        if name not in SHOWN_ELSEWHERE:
            origin[TITLES.get(name, name.replace("_", " "))] = _attribute(name, value)
    settings = run.data.get("integration")
    if isinstance(settings, dict):
        origin |= {key: settings[key] for key in ("method", "rtol", "atol") if key in settings}
    return origin


def _attribute(name: str, value: Any) -> Any:
    if not isinstance(value, float):
        return value
    if not math.isfinite(value):
        return UNBOUNDED if value > 0 else None
    return round(value, 3) if name.endswith("wall_time") else value


def repeat_command(run: Run) -> str:
    """Return the command that repeats a run from its result, in the folder `again`."""
    # NAME.yaml may be the user's own config; the command must not overwrite it.
    file, config = shell_word(run.path), shell_word(f"{run.name}-again.yaml")
    show, again = f"rbstab show {file} --config > {config}", f"rbstab run {config} -o again"
    return untrusted(chained_commands(show, again))


def _keys(records: Mapping[str, Flat], *, differing: bool) -> list[str]:
    """Return the keys in which records differ, or those in which they are equal."""
    every = list(records.values())
    return [
        key
        for key in dict.fromkeys(key for record in every for key in record)
        if not SOURCE.fullmatch(key)
        and any(record.get(key) != every[0].get(key) for record in every) == differing
    ]


def _rows(records: Mapping[str, Flat], keys: Sequence[str]) -> list[list[Cell]]:
    """Return a row for each record, with its values of some keys."""
    return [
        [Cell(label), *(_cell(record.get(key)) for key in keys)]
        for label, record in records.items()
    ]


def _equal(
    name: str, title: str, records: Mapping[str, Flat], head: str, named: Callable[[str], str]
) -> list[Block]:
    """Return a table with a row for each key that is equal in all records; [] without any."""
    first = next(iter(records.values()), {})
    rows = [(named(key), _cell(first[key])) for key in _keys(records, differing=False)]
    return [Table.of(name, title, (head, "value"), rows)] if rows else []


def flat(data: Mapping[str, Any], prefix: str = "") -> Flat:
    """Return the values of a config by dotted key, as on the command line; a list is one value."""
    values: Flat = {}
    for key, value in data.items():
        if not prefix and key in OMITTED_KEYS:
            continue
        name = f"{prefix}{key}"
        values |= flat(value, f"{name}.") if isinstance(value, dict) else {name: value}
    return values


def _unit(key: str, configs: Mapping[str, Flat]) -> str:
    """Return the unit of a key; that of an element depends on its kind."""
    if key in TIMES:
        return "s"
    element = ".".join(key.split(".")[:2]) + "."
    sections = (
        {name.removeprefix(element): config[name] for name in config if name.startswith(element)}
        for config in configs.values()
    )
    return unit_of(key, (section for section in sections if "kind" in section))


def with_unit(key: str, configs: Mapping[str, Flat]) -> str:
    """Return a key with its unit, for a table of configs."""
    return Head(untrusted(key), _unit(key, configs)).text


def _is_number(value: object) -> TypeGuard[int | float]:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _cell(value: object) -> Cell:
    return Cell(value_text(value), float(value) if _is_number(value) else None)


def value_text(value: object) -> str:
    """Return a value of a config as text that is safe to print; `NO_VALUE` for None."""
    if _is_number(value):
        return number(value, 12)
    return NO_VALUE if value in (None, "") else untrusted(_text(value))


def _text(value: object) -> str:
    """Return a config value as text; only the ends of a long list, as of a table of an input."""
    if not isinstance(value, list):
        return number(value, 12) if isinstance(value, float) else str(value)
    entries = [_text(entry) for entry in value]
    if len(entries) > MAX_LISTED:
        shown = ", ".join((*entries[:3], "...", *entries[-3:]))
        return f"[{shown}] ({len(entries)} entries)"
    return f"[{', '.join(entries)}]"
