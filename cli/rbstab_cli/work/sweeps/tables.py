"""Results, status and size of a sweep, printed as tables or as JSON."""

import shutil
from dataclasses import asdict
from pathlib import Path
from typing import Any

import click

from rbstab.analysis.lyapunov import ENERGY_SCALE
from rbstab.experiment.answers.rounded import NO_VALUE, number
from rbstab.files.paths import exists
from rbstab.files.text import grouped
from rbstab.integrate.status import RunStatus
from rbstab.processes.processors import processor_count
from rbstab.store.disk.lock import is_locked
from rbstab.sweep.folder.manifest import Manifest
from rbstab.sweep.folder.member_answers import SWEEP_FACTS, MemberAnswers, member_answers
from rbstab.sweep.folder.members_file import (
    counts_by_status,
    digest_of_shards,
    is_finished,
    members_of_shards,
)
from rbstab.sweep.folder.open_folder import planned_folder, sweep_bytes
from rbstab.sweep.folder.outcomes import SweepOutcomes
from rbstab.sweep.folder.shard_inventory import shard_inventory
from rbstab.sweep.folder.sweep_folder import read_folder
from rbstab.sweep.options import SweepOptions
from rbstab.sweep.plan.plan import Plan
from rbstab.sweep.sweep import Sweep
from rbstab_cli.output.runs import print_statement
from rbstab_cli.printing import Table, print_facts, print_json, say

Data = dict[str, Any]

MEANINGS = {
    "proved": "they converge to a rest state",
    "false": "proved that they do not come to rest",
    "seen": "at rest by the end of their computed run, not proved",
    "not decided": "neither proved, nor at rest by the end of their computed run",
}
"""What the words say of the members of a sweep."""

NUMBERS = ("settling time, median of those settled", f"largest |r|/{ENERGY_SCALE}")
"""The facts about a sweep that are numbers."""


def report_sweep(
    sweep: Sweep, *, as_json: bool = False, proofs: Data | None = None, proofs_follow: bool = False
) -> None:
    """Print the outcomes of the members, then how their runs ended.

    Args:
        sweep: The sweep.
        as_json: Whether to print JSON.
        proofs: What was proved of the members, for JSON.
        proofs_follow: Whether what is proved is printed afterwards, and so is not counted here.
    """
    folder, comparison = sweep.folder, sweep.comparison
    by_status = counts_by_status(sweep.inventory.counts)
    answers = member_answers(folder.sweep_file) if sweep.finished else None
    members = folder.manifest.members
    part: Data = {}
    if sweep.part is not None:
        numbers = sweep.part.shard_numbers(folder.shards)
        members = folder.members_of(numbers)
        done = len(numbers) - len(sweep.inventory.missing)
        counts = {"shards": len(numbers), "done_shards": done, "members": members}
        part = {"part": sweep.part._asdict() | counts}
    if as_json:
        check = None if comparison is None else asdict(comparison)
        data = _sweep_data(folder.path, folder.manifest, by_status)
        data |= part | {"finished": sweep.finished, "check": check}
        if sweep.inventory.missing:
            data["missing"] = folder.ranges(sweep.inventory.missing)
        if answers is not None:
            data = answers.outcomes.data | answers.summary | data | _answers_data(answers)
        print_json(data if proofs is None else data | {"proofs": proofs})
        return
    if answers is not None:
        outcomes = answers.outcomes
        _print_outcomes(outcomes._replace(proved=0) if proofs_follow else outcomes)
        _print_disturbed(answers)
    _print_statuses(by_status, members)
    if answers is None:
        return
    settled = f"{grouped(answers.settled)} of {grouped(answers.completed)}"
    rows = {"settled": f"{settled} ({answers.outcomes.at_rest} to the end)"}
    rows |= {name: SWEEP_FACTS[name].text(answers) or NO_VALUE for name in NUMBERS}
    if not proofs_follow and answers.any_proof:
        rows["converge to a rest state"] = counts_of(answers)
    if comparison is not None and comparison.members:
        # The largest difference of all columns, and the number of unlike members.
        worst, difference = max(comparison.differences.items(), key=lambda item: item[1])
        unlike = f"{comparison.unlike} unlike, " if comparison.unlike else ""
        largest = f"{unlike}largest relative difference {number(difference, 2)} ({worst})"
        rows["rerun with scipy"] = f"{len(comparison.members)} members, {largest}"
    print_facts(rows.items())


def counts_of(answers: MemberAnswers) -> str:
    """Return for how many members each answer holds: "3143 proved, 857 seen"."""
    note = " (without proofs made later)" if answers.as_finished else ""
    counts = (f"{grouped(count)} {word}" for word, count in answers.by_word.items() if count)
    return ", ".join(counts) + note


def _answers_data(sweep_answers: MemberAnswers) -> Data:
    """Return the answers about the members of a sweep as data for JSON."""
    disturbed = None if sweep_answers.disturbed is None else sweep_answers.disturbed.data
    answers = sweep_answers._asdict() | {
        "one_state": sweep_answers.sole_state.data,
        "disturbed": disturbed,
    }
    del answers["outcomes"], answers["summary"], answers["sole_state"]
    return {"answers": answers}


def _print_outcomes(outcomes: SweepOutcomes) -> None:
    """Print what became of the members, what is wanted, and which parameter decides."""
    first, *others = outcomes.parts
    green = "green" if outcomes.all_return else None
    print_statement("Outcome", "; ".join([click.style(first, fg=green), *others]))
    print_statement("Desired", str(outcomes.aim))
    if outcomes.deciding:
        print_statement("Decides", outcomes.deciding)


def _print_disturbed(answers: MemberAnswers) -> None:
    """Print how far disturbances tilt the members, if the plan states a bound."""
    if answers.disturbed is not None:
        for word, sentence in answers.disturbed.statements.items():
            print_statement(word, sentence)


def print_member_answers(answers: MemberAnswers) -> None:
    """Print the answers about the members of a sweep: their outcomes, and how sure they are."""
    _print_outcomes(answers.outcomes)
    _print_disturbed(answers)
    members = f"of {grouped(answers.members)} members"
    for word, count in answers.by_word.items():
        if count:
            print_statement(word, f"{grouped(count)} {members}: {MEANINGS[word]}")
    for sentence in answers.sole_state.sentences:
        print_statement("rest states", sentence)
    which = f"{grouped(answers.settled)} of the {grouped(answers.completed)} that completed"
    print_statement("settled", f"{which}: {answers.outcomes.at_rest} to the end")
    for why, count in answers.without_proof.items():
        print_statement("no proof", f"{grouped(count)} {members}: {why}")
    if answers.as_finished:
        click.echo("  Proofs made after the sweep was finished are not counted.")


def report_status(path: Path, *, as_json: bool, answers: MemberAnswers | None = None) -> None:
    """Print how many members of the sweep in a folder are done, and whether it is running.

    Args:
        path: The folder.
        as_json: Whether to print JSON.
        answers: What is known of its members, for JSON.

    Raises:
        StoreError: It is not the folder of a sweep, or cannot be read.
    """
    folder = read_folder(path)
    manifest, inventory = folder.manifest, shard_inventory(folder)
    damaged = inventory.damaged
    table = None if inventory.missing else members_of_shards(folder, digest_of_shards(inventory))
    finished = is_finished(folder, table)
    by_status = counts_by_status(inventory.counts)
    running = is_locked(path)
    kept = manifest.keep.count(manifest.members)
    if as_json:
        first = {} if answers is None else answers.outcomes.data | _answers_data(answers)
        more = {"finished": finished, "running": running, "damaged_shards": damaged}
        print_json(first | _sweep_data(path, manifest, by_status) | more | {"traces": kept})
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
    print_facts(rows.items())
    _print_statuses(by_status, manifest.members)


def report_dry_run(plan: Plan, path: Path, options: SweepOptions, *, as_json: bool) -> None:
    """Print how many members a plan has, how many of them are done, and the disk space.

    Args:
        plan: The plan.
        path: The folder of the sweep; it need not exist.
        options: The options; their part, shard size and threads count.
        as_json: Whether to print JSON.
    """
    folder, matches = planned_folder(path, plan, options.shard_size)
    part, shards = options.part, folder.shards
    numbers = range(shards) if part is None else part.shard_numbers(shards)
    if matches is False:
        say(f"{path} holds a different sweep. Move it aside with --force.")
    members = folder.members_of(numbers)
    done = shard_inventory(folder, numbers).members if matches else 0
    threads = options.threads or processor_count()
    # A part has its share of the disk space of the whole.
    space = round(sweep_bytes(plan) * members / plan.members)
    if as_json:
        data = {"folder": str(path), "engine": plan.engine, "threads": threads}
        print_json(data | {"members": members, "done": done, "bytes": space})
        return
    parent = next(folder for folder in (path, *path.absolute().parents) if exists(folder))
    product = " x ".join(map(grouped, plan.dimensions.values()))
    rows = {
        "folder": str(path),
        "engine": f"{plan.engine}, {threads} threads",
        "members": f"{product} = {grouped(plan.members)}",
        **({f"of part {part}": grouped(members)} if part is not None else {}),
        "done": grouped(done),
        "disk": f"{size(space)} of {size(shutil.disk_usage(parent).free)} free",
    }
    print_facts(rows.items())


def size(count: int) -> str:
    """Return a number of bytes with its unit."""
    units = ("kB", "MB", "GB")
    index = min(max((len(str(count)) - 1) // 3, 1), len(units)) - 1
    return f"{count / 1000 ** (index + 1):.3g} {units[index]}"


def _sweep_data(path: Path, manifest: Manifest, by_status: dict[str, int]) -> Data:
    return {
        "folder": str(path),
        "title": manifest.title,
        "plan_id": manifest.plan_id,
        "engine": manifest.engine,
        "members": manifest.members,
        "done": sum(by_status.values()),
        "by_status": by_status,
    }


def _print_statuses(by_status: dict[str, int], members: int) -> None:
    numbers = ("members", "share")
    table = Table("status", *numbers, words=("status",), numbers=numbers)
    remaining = members - sum(by_status.values())
    rows = by_status | ({"not done": remaining} if remaining else {})
    for status, count in rows.items():
        style = None if status == RunStatus.COMPLETED else "yellow"
        table.add(status, grouped(count), f"{count / members:.2%}", style=style)
    table.print()
