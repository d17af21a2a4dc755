"""What `rbstab show` prints of everything that is not the file of a run."""

from pathlib import Path
from typing import Any

import click

from rbstab.config.errors import printable
from rbstab.files.existence import is_file
from rbstab.files.shell_words import shell_word
from rbstab.listing.inner_folders import rows_of
from rbstab.listing.kinds import INNER_FOLDERS, Kind, kind_of, sweep_folder_of
from rbstab.listing.proofs import what_it_says
from rbstab.report.model.words import listed
from rbstab.report.reading.not_results import CONFIG, PLAN, not_a_result, what_it_is
from rbstab.store.errors import NotAResultError
from rbstab.store.motions import read_motions
from rbstab.sweep.folder.member_answers import member_answers
from rbstab.sweep.folder.sweep_folder import (
    SWEEP_FILE,
    proving_member,
    read_folder,
    resuming_command,
)
from rbstab.sweep.members.outcome import STATUSES
from rbstab_cli.output.warnings import print_unread_proofs
from rbstab_cli.printing import Table, print_json, say
from rbstab_cli.work.stored.list import list_results
from rbstab_cli.work.sweeps.tables import print_member_answers, report_status

Facts = dict[str, Any]

MAX_MEMBERS = 10
"""The most members with traces that are named."""


def show_other(path: Path, *, as_json: bool, as_config: bool) -> int | None:
    """Print a sweep, a file in its folder, a proof, or a folder of results or proofs.

    Raises:
        StoreError: It cannot be read.
        UsageError: It is a config or a plan; or it has no config to print.
    """
    kind = kind_of(path)
    if kind is Kind.CONFIG or what_it_is(path) in {CONFIG, PLAN}:
        raise click.UsageError(
            f"{path} {not_a_result(path)}; or check it: rbstab check {shell_word(path)}"
        )
    if kind is Kind.RUN:
        raise NotAResultError(f"{path} {not_a_result(path)}")
    if as_config:
        raise click.UsageError(f"{path} is a {kind}; only a run has a config to print")
    if kind is Kind.FOLDER:
        return list_results(path, as_json)
    if kind in INNER_FOLDERS:
        _show_inner(path, kind, as_json=as_json)
    elif kind is Kind.SWEEP:
        _show_sweep(sweep_folder_of(path), as_json=as_json)
    else:
        read = {Kind.SHARD: _shard_facts, Kind.TRACES: _traces_facts, Kind.PROOF: _proof_facts}
        _print_facts(read[kind](path), as_json=as_json)
    return None


def _show_inner(path: Path, kind: Kind, *, as_json: bool) -> None:
    """Print what a folder of proofs, of shards or of traces holds."""
    rows = rows_of(path, kind)
    if as_json:
        print_json(rows)
    elif not rows:
        say(f"{path} has no {kind}.")
    else:
        click.echo(f"{path}: {kind}")
        columns = tuple(rows[0])
        table = Table(*columns, words=columns[:1])
        for row in rows:
            table.add(*row.values())
        table.print()


def _show_sweep(folder: Path, *, as_json: bool) -> None:
    title = read_folder(folder).manifest.title
    finished = is_file(folder / SWEEP_FILE)
    if finished:
        print_unread_proofs([folder.parent])
    answers = member_answers(folder / SWEEP_FILE) if finished else None
    if as_json:
        report_status(folder, as_json=True, answers=answers)
        return
    if answers is not None:
        click.echo(printable(title))
        print_member_answers(answers)
    report_status(folder, as_json=False)
    report = f"rbstab report {shell_word(folder)}"
    say(f"Next: {report if finished else resuming_command(folder)}")
    if answers is not None and answers.provable is not None:
        command = proving_member(folder, answers.provable)
        say(f"Or try to prove a member that is only seen: {command}")


def _shard_facts(path: Path) -> Facts:
    folder = read_folder(sweep_folder_of(path))
    number = int(path.stem) if path.stem.isdigit() else folder.shards
    if number >= folder.shards:
        raise NotAResultError(f"{path} is not a shard of the sweep {folder.path}")
    table = folder.read(number)
    first, stop = folder.bounds(number)
    statuses = table["status"].tolist()
    counts = {str(s): statuses.count(i) for i, s in enumerate(STATUSES) if i in statuses}
    return {
        "sweep": folder.manifest.title,
        "folder": str(folder.path),
        "shard": f"{number} of {folder.shards}, from 0",
        "members": f"{first} to {stop - 1}",
        **{f"members {status}": count for status, count in counts.items()},
        "columns": ", ".join(table.columns),
    }


def _traces_facts(path: Path) -> Facts:
    folder = read_folder(sweep_folder_of(path))
    motions = read_motions(path)
    members = motions["run"].tolist()
    return {
        "sweep": folder.manifest.title,
        "folder": str(folder.path),
        "members": listed(map(str, members), MAX_MEMBERS),
        "motions": len(members),
        "samples": len(motions["time"]),
        "arrays": ", ".join(motions.variables),
    }


def _proof_facts(path: Path) -> Facts:
    """Return the sentences of a proof of any kind, by its file's name."""
    said = what_it_says(path)
    return {"kind": said.kind, "statements": said.sentences, "id": said.id, "seconds": said.seconds}


def _print_facts(facts: Facts, *, as_json: bool) -> None:
    if as_json:
        print_json(facts)
        return
    table = Table("quantity", "value")
    for name, value in facts.items():
        for index, text in enumerate(value if isinstance(value, list) else [value]):
            table.add(name if index == 0 else "", str(text))
    table.print()
