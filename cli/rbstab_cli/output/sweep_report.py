"""What `rbstab sweep` found out, for people and machines."""

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from rbstab.sweep.options import SweepOptions
    from rbstab.sweep.plan.plan import Plan
    from rbstab.sweep.sweep import Sweep

ENOUGH = 16
"""Members of a variant on which an estimate may rest without a word."""


def report_sweep(done: "Sweep", *, as_json: bool) -> None:
    """Prints what has become of the members."""
    from rbstab.sweep.folder.gather import counts_by_status, sweep_summary

    by_status = counts_by_status(done.inventory.counts)
    summary = sweep_summary(done.folder.sweep_file) if done.finished else None
    if as_json:
        from rbstab_cli.output.json_output import print_json

        check = asdict(done.comparison) if done.comparison is not None else None
        facts = _facts(done.folder.path, done.folder.manifest, by_status)
        found = summary._asdict() if summary is not None else {}
        facts |= _facts_of_part(done) | {"finished": done.finished, "check": check}
        if done.inventory.missing:
            facts["missing"] = done.folder.ranges(done.inventory.missing)
        print_json(found | facts)
        return
    _print_statuses(by_status, members_in(done))
    if summary is None:
        return
    from rbstab_cli.output.tables import number

    completed = by_status.get("completed", 0)
    rows = {
        "settled": f"{summary.settled} of {completed}",
        "settling time, median": f"{number(summary.settling_median)} s" if summary.settled else "-",
        "worst |r| / v(0)": number(summary.worst_residual, 2),
    }
    if done.comparison is not None and done.comparison.members:
        rows["repeated with scipy"] = (
            f"{len(done.comparison.members)} members, {_differences(done)}"
        )
    _print_facts(rows)


def members_in(done: "Sweep") -> int:
    """How many members a sweep has, or a part of one."""
    if done.part is None:
        return done.folder.manifest.members
    return done.folder.members_of(done.part.of(done.folder.shards))


def _facts_of_part(done: "Sweep") -> dict[str, Any]:
    if done.part is None:
        return {}
    shards = len(done.part.of(done.folder.shards))
    numbers = {"shards": shards, "done_shards": shards - len(done.inventory.missing)}
    return {"part": done.part._asdict() | numbers | {"members": members_in(done)}}


def report_status(path: Path, *, as_json: bool) -> None:
    """Prints how far the sweep in a folder is.

    Raises:
        StoreError: It is not the folder of a sweep, or cannot be read.
    """
    from rbstab.store.lock import is_locked
    from rbstab.sweep.folder.gather import counts_by_status, digest_of_shards, is_gathered
    from rbstab.sweep.folder.parts import running_parts
    from rbstab.sweep.folder.shard_inventory import shard_inventory
    from rbstab.sweep.folder.sweep_folder import read_folder

    folder = read_folder(path)
    inventory = shard_inventory(folder)
    damaged = [number for number in inventory.missing if folder.shard_file(number).exists()]
    gathered = not inventory.missing and is_gathered(folder, digest_of_shards(inventory))
    by_status = counts_by_status(inventory.counts)
    parts = running_parts(path)
    running = bool(parts) or is_locked(path)
    manifest = folder.manifest
    kept = manifest.keep.count(manifest.members)
    if as_json:
        from rbstab_cli.output.json_output import print_json

        more = {"finished": gathered, "running": running, "damaged_shards": damaged}
        more |= {"running_parts": [part._asdict() for part in parts], "traces": kept}
        print_json(_facts(path, manifest, by_status) | more)
        return
    rows = {
        "title": manifest.title,
        "plan": manifest.plan_id[:8],
        "engine": manifest.engine,
        "members": str(manifest.members),
        "done": f"{inventory.members} ({inventory.members / manifest.members:.1%})",
        "shards": f"{len(inventory.done)} of {folder.shards}, {len(damaged)} damaged",
        "traces": f"of {kept} members, when all are done" if kept else "none",
        "running": ", ".join(f"part {part}" for part in parts) or ("yes" if running else "no"),
        "gathered": f"{folder.sweep_file}" if gathered else "no",
    }
    _print_facts(rows)
    _print_statuses(by_status, manifest.members)


def report_estimate(plan: "Plan", path: Path, options: "SweepOptions", *, as_json: bool) -> None:
    """Prints how much of a plan is to be done, and what it will take."""
    import shutil

    from rbstab.processes.processors import processor_count
    from rbstab.sweep.execution.estimate import estimate
    from rbstab.sweep.members.engines import factory_for
    from rbstab_cli.output.sweep_progress import duration

    members, done = _extent(plan, path, options)
    threads = options.threads or processor_count()
    factory = options.factory or factory_for(plan.engine)
    found = estimate(plan, members - done, factory, threads)
    if options.part is not None:
        # A part compares and gathers nothing.
        share = members / plan.members
        found = found._replace(check_seconds=0.0, bytes=round(found.bytes * share))
    if as_json:
        from rbstab_cli.output.json_output import print_json

        facts = {"folder": str(path), "engine": plan.engine, "threads": threads}
        print_json(facts | {"members": members, "done": done} | found._asdict())
        return
    parent = next(folder for folder in (path, *path.absolute().parents) if folder.exists())
    free = shutil.disk_usage(parent).free
    rows = {
        "folder": str(path),
        "engine": f"{plan.engine}, {threads} threads",
        "members": " x ".join(map(str, plan.dimensions.values())) + f" = {plan.members}",
        **({f"of part {options.part}": str(members)} if options.part is not None else {}),
        "done": str(done),
        "time": f"about {duration(found.seconds)}{_few(found.calibrated)}",
        "comparison with scipy": f"about {duration(found.check_seconds)}",
        "disk": f"{size(found.bytes)} of {size(free)} that are free",
    }
    _print_facts(rows)


def _few(calibrated: int) -> str:
    """A word on an estimate that rests on few members."""
    return f", from {calibrated} members of a variant" if 0 < calibrated < ENOUGH else ""


def _extent(plan: "Plan", path: Path, options: "SweepOptions") -> tuple[int, int]:
    """How many members there are, of the part if it is one, and how many of them are done."""
    from rbstab.sweep.folder.open_folder import planned_folder
    from rbstab.sweep.folder.shard_inventory import shard_inventory

    folder, begun = planned_folder(path, plan, options.shard_size)
    numbers = range(folder.shards) if options.part is None else options.part.of(folder.shards)
    if begun is False:
        click.echo(f"{path} holds a different sweep; --force moves it aside", err=True)
    return folder.members_of(numbers), shard_inventory(folder, numbers).members if begun else 0


def size(count: int) -> str:
    """A number of bytes in words."""
    units = ("kB", "MB", "GB")
    index = min(max((len(str(count)) - 1) // 3, 1), len(units)) - 1
    return f"{count / 1000 ** (index + 1):.3g} {units[index]}"


def _facts(path: Path, manifest: Any, by_status: dict[str, int]) -> dict[str, Any]:
    return {
        "folder": str(path),
        "title": manifest.title,
        "plan_id": manifest.plan_id,
        "engine": manifest.engine,
        "members": manifest.members,
        "done": sum(by_status.values()),
        "by_status": by_status,
    }


def _differences(done: "Sweep") -> str:
    """The largest difference of all columns, and whether there are members that are unlike."""
    from rbstab_cli.output.tables import number

    assert done.comparison is not None
    differences = done.comparison.differences
    worst = max(differences, key=lambda name: differences[name])
    unlike = f"{done.comparison.unlike} unlike, " if done.comparison.unlike else ""
    return f"{unlike}largest relative difference {number(differences[worst], 2)} ({worst})"


def _print_statuses(by_status: dict[str, int], members: int) -> None:
    from rbstab_cli.output.tables import row, show, table

    numbers = ("members", "share")
    made = table("status", *numbers, words=("status",), numbers=numbers)
    remaining = members - sum(by_status.values())
    rows = by_status | ({"not done": remaining} if remaining else {})
    for status, count in rows.items():
        style = None if status == "completed" else "yellow"
        row(made, status, str(count), f"{count / members:.2%}", style=style)
    show(made)


def _print_facts(rows: dict[str, str]) -> None:
    from rbstab_cli.output.tables import row, show, table

    made = table("quantity", "value")
    for name, value in rows.items():
        row(made, name, value)
    show(made)
