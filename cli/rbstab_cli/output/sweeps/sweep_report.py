"""Results, status and size of a sweep, printed as tables or as JSON."""

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from rbstab.files.counts import grouped

if TYPE_CHECKING:
    from rbstab.sweep.folder.member_answers import MemberAnswers
    from rbstab.sweep.folder.outcomes import SweepOutcomes
    from rbstab.sweep.options import SweepOptions
    from rbstab.sweep.plan.plan import Plan
    from rbstab.sweep.sweep import Sweep
    from rbstab_cli.output.sweeps.sweep_answers import Answers


def report_sweep(
    sweep: "Sweep",
    *,
    as_json: bool = False,
    answers: "Answers | None" = None,
    proofs_follow: bool = False,
) -> None:
    """Print the outcomes of the members, then how their runs ended.

    Args:
        sweep: The sweep.
        as_json: Whether to print JSON.
        answers: What was proved of the members, for JSON.
        proofs_follow: Whether what is proved is printed afterwards, and so is not counted here.
    """
    from rbstab.sweep.folder.member_answers import member_answers
    from rbstab.sweep.folder.members_file import counts_by_status

    by_status = counts_by_status(sweep.inventory.counts)
    found = member_answers(sweep.folder.sweep_file) if sweep.finished else None
    if as_json:
        from rbstab_cli.output.json_output import print_json

        check = asdict(sweep.comparison) if sweep.comparison is not None else None
        data = _sweep_data(sweep.folder.path, sweep.folder.manifest, by_status)
        data |= _part_data(sweep) | {"finished": sweep.finished, "check": check}
        if sweep.inventory.missing:
            data["missing"] = sweep.folder.ranges(sweep.inventory.missing)
        if found is not None:
            data = found.outcomes.data | found.summary | data
            data["answers"] = answers_data(found)
        if answers is not None:
            data["proofs"] = answers.data
        print_json(data)
        return
    if found is not None:
        outcomes = found.outcomes
        print_outcomes(outcomes._replace(proved=0) if proofs_follow else outcomes)
    _print_statuses(by_status, member_count(sweep))
    if found is None:
        return
    from rbstab.analysis.lyapunov import ENERGY_SCALE
    from rbstab_cli.output.tables import number

    completed = by_status.get("completed", 0)
    share = f"{grouped(found.settled)} of {grouped(completed)}"
    median = number(found.summary["settling_median"])
    rows = {
        "settled": f"{share} ({found.outcomes.at_rest} to the end)",
        "settling time, median": f"{median} s, of those settled" if found.settled else "-",
        f"worst |r| / {ENERGY_SCALE}": number(found.summary["worst_residual"], 2),
    }
    if not proofs_follow and found.any_proof:
        rows["converge to a rest state"] = counts_of(found)
    if sweep.comparison is not None and sweep.comparison.members:
        rows["rerun with scipy"] = f"{len(sweep.comparison.members)} members, {_differences(sweep)}"
    _print_rows(rows)


def counts_of(found: "MemberAnswers") -> str:
    """Return for how many members each answer holds: "3143 proved, 857 seen"."""
    note = " (without proofs made later)" if found.as_finished else ""
    counts = (f"{grouped(count)} {word}" for word, count in found.by_word.items() if count)
    return ", ".join(counts) + note


def answers_data(found: "MemberAnswers") -> dict[str, Any]:
    """Return the answers about the members of a sweep as data for JSON."""
    data = found._asdict() | {"one_state": found.one_state.data}
    del data["outcomes"], data["summary"]
    return data


def print_outcomes(outcomes: "SweepOutcomes") -> None:
    """Print what became of the members, what is wanted, and which parameter decides."""
    first, *others = outcomes.parts
    green = "green" if outcomes.all_return else None
    text = "; ".join([click.style(first, fg=green), *others])
    for name, line in (
        ("Outcome", text),
        ("Desired", str(outcomes.aim)),
        ("Decides", outcomes.deciding),
    ):
        if line:
            click.echo(f"  {name + ':':<13}{line}.")


def print_member_answers(found: "MemberAnswers") -> None:
    """Print the answers about the members of a sweep: their outcomes, and how sure they are."""
    print_outcomes(found.outcomes)
    meanings = {
        "proved": "they converge to a rest state",
        "false": "proved that they do not come to rest",
        "seen": "at rest by the end of their computed run, not proved",
        "not decided": "neither proved, nor at rest by the end of their computed run",
    }
    members = grouped(found.members)
    for word, count in found.by_word.items():
        if not count:
            continue
        click.echo(f"  {word + ':':<13}{grouped(count)} of {members} members: {meanings[word]}.")
    for sentence in found.one_state.sentences:
        click.echo(f"  {'rest states:':<13}{sentence}.")
    which = f"{grouped(found.settled)} of the {grouped(found.completed)} that completed"
    click.echo(f"  {'settled:':<13}{which}: {found.outcomes.at_rest} to the end.")
    for why, count in found.without_proof.items():
        click.echo(f"  {'no proof:':<13}{grouped(count)} of {members} members: {why}.")
    if found.as_finished:
        click.echo("  Proofs made after the sweep was finished are not counted.")


def member_count(sweep: "Sweep") -> int:
    """Return the number of members of a sweep, or of the part that was run."""
    if sweep.part is None:
        return sweep.folder.manifest.members
    return sweep.folder.members_of(sweep.part.shard_numbers(sweep.folder.shards))


def _part_data(sweep: "Sweep") -> dict[str, Any]:
    if sweep.part is None:
        return {}
    shards = len(sweep.part.shard_numbers(sweep.folder.shards))
    numbers = {"shards": shards, "done_shards": shards - len(sweep.inventory.missing)}
    return {"part": sweep.part._asdict() | numbers | {"members": member_count(sweep)}}


def report_status(path: Path, *, as_json: bool, answers: "MemberAnswers | None" = None) -> None:
    """Print how many members of the sweep in a folder are done, and whether it is running.

    Args:
        path: The folder.
        as_json: Whether to print JSON.
        answers: What is known of its members, for JSON.

    Raises:
        StoreError: It is not the folder of a sweep, or cannot be read.
    """
    from rbstab.store.disk.lock import is_locked
    from rbstab.sweep.folder.members_file import (
        counts_by_status,
        digest_of_shards,
        is_finished,
        members_of_shards,
    )
    from rbstab.sweep.folder.shard_inventory import shard_inventory
    from rbstab.sweep.folder.sweep_folder import read_folder

    folder = read_folder(path)
    inventory = shard_inventory(folder)
    damaged = inventory.damaged
    known = None if inventory.missing else members_of_shards(folder, digest_of_shards(inventory))
    finished = is_finished(folder, known)
    by_status = counts_by_status(inventory.counts)
    running = is_locked(path)
    manifest = folder.manifest
    kept = manifest.keep.count(manifest.members)
    if as_json:
        from rbstab_cli.output.json_output import print_json

        more = {"finished": finished, "running": running, "damaged_shards": damaged}
        more |= {"traces": kept}
        first = {} if answers is None else answers.outcomes.data
        first |= {} if answers is None else {"answers": answers_data(answers)}
        print_json(first | _sweep_data(path, manifest, by_status) | more)
        return
    rows = {
        "title": manifest.title,
        "plan": manifest.plan_id[:8],
        "engine": manifest.engine,
        "members": grouped(manifest.members),
        "done": f"{grouped(inventory.members)} ({inventory.members / manifest.members:.1%})",
        "shards": f"{len(inventory.done)} of {folder.shards}, {len(damaged)} damaged",
        "traces": f"of {grouped(kept)} members when all are done" if kept else "none",
        "running": "yes" if running else "no",
        "finished": "yes" if finished else "no",
    }
    _print_rows(rows)
    _print_statuses(by_status, manifest.members)


def report_dry_run(plan: "Plan", path: Path, options: "SweepOptions", *, as_json: bool) -> None:
    """Print how many members a plan has, how many of them are done, and the disk space."""
    import shutil

    from rbstab.files.existence import exists
    from rbstab.processes.processors import processor_count
    from rbstab.sweep.folder.open_folder import sweep_bytes

    members, done = _member_counts(plan, path, options)
    threads = options.threads or processor_count()
    # A part has its share of the disk space of the whole.
    space = round(sweep_bytes(plan) * members / plan.members)
    if as_json:
        from rbstab_cli.output.json_output import print_json

        data = {"folder": str(path), "engine": plan.engine, "threads": threads}
        print_json(data | {"members": members, "done": done, "bytes": space})
        return
    parent = next(folder for folder in (path, *path.absolute().parents) if exists(folder))
    free = shutil.disk_usage(parent).free
    rows = {
        "folder": str(path),
        "engine": f"{plan.engine}, {threads} threads",
        "members": " x ".join(map(grouped, plan.dimensions.values()))
        + f" = {grouped(plan.members)}",
        **({f"of part {options.part}": grouped(members)} if options.part is not None else {}),
        "done": grouped(done),
        "disk": f"{size(space)} of {size(free)} free",
    }
    _print_rows(rows)


def _member_counts(plan: "Plan", path: Path, options: "SweepOptions") -> tuple[int, int]:
    """Return how many members the plan (or the part) has, and how many of them are done."""
    from rbstab.sweep.folder.open_folder import planned_folder
    from rbstab.sweep.folder.shard_inventory import shard_inventory

    folder, matches = planned_folder(path, plan, options.shard_size)
    part, shards = options.part, folder.shards
    numbers = range(shards) if part is None else part.shard_numbers(shards)
    if matches is False:
        click.echo(f"{path} holds a different sweep. Move it aside with --force.", err=True)
    return folder.members_of(numbers), shard_inventory(folder, numbers).members if matches else 0


def size(count: int) -> str:
    """Return a number of bytes with its unit."""
    units = ("kB", "MB", "GB")
    index = min(max((len(str(count)) - 1) // 3, 1), len(units)) - 1
    return f"{count / 1000 ** (index + 1):.3g} {units[index]}"


def _sweep_data(path: Path, manifest: Any, by_status: dict[str, int]) -> dict[str, Any]:
    return {
        "folder": str(path),
        "title": manifest.title,
        "plan_id": manifest.plan_id,
        "engine": manifest.engine,
        "members": manifest.members,
        "done": sum(by_status.values()),
        "by_status": by_status,
    }


def _differences(sweep: "Sweep") -> str:
    """Return the largest difference of all columns, and the number of unlike members, as a text."""
    from rbstab_cli.output.tables import number

    assert sweep.comparison is not None
    differences = sweep.comparison.differences
    worst = max(differences, key=lambda name: differences[name])
    unlike = f"{sweep.comparison.unlike} unlike, " if sweep.comparison.unlike else ""
    return f"{unlike}largest relative difference {number(differences[worst], 2)} ({worst})"


def _print_statuses(by_status: dict[str, int], members: int) -> None:
    from rbstab.integrate.status import RunStatus
    from rbstab_cli.output.tables import add_row, new_table, print_table

    numbers = ("members", "share")
    table = new_table("status", *numbers, words=("status",), numbers=numbers)
    remaining = members - sum(by_status.values())
    rows = by_status | ({"not done": remaining} if remaining else {})
    for status, count in rows.items():
        style = None if status == RunStatus.COMPLETED else "yellow"
        add_row(table, status, grouped(count), f"{count / members:.2%}", style=style)
    print_table(table)


def _print_rows(rows: dict[str, str]) -> None:
    from rbstab_cli.output.tables import add_row, new_table, print_table

    table = new_table("quantity", "value")
    for name, value in rows.items():
        add_row(table, name, value)
    print_table(table)
