"""What `rbstab show` prints of everything that is not the file of a run."""

from pathlib import Path

import click

from rbstab.files.paths import is_file
from rbstab.files.text import printable, shell_word
from rbstab.listing.proofs import proof_rows, what_it_says
from rbstab.report.reading.kinds import Kind, not_a_result, sweep_folder_of
from rbstab.store.errors import NotAResultError
from rbstab.sweep.folder.member_answers import member_answers
from rbstab.sweep.folder.sweep_folder import (
    SWEEP_FILE,
    proving_member,
    read_folder,
    resuming_command,
)
from rbstab_cli.output.runs import print_unread_proofs
from rbstab_cli.printing import Table, print_facts, print_json, say
from rbstab_cli.work.stored.list import list_results
from rbstab_cli.work.sweeps.tables import print_member_answers, report_status


def show_other(path: Path, kind: Kind, *, as_json: bool, as_config: bool) -> int | None:
    """Print a sweep, a proof, or a folder of results or proofs.

    Args:
        path: The file or folder.
        kind: What it is.
        as_json: Whether to print JSON.
        as_config: Whether only its config is asked for; none of these has one.

    Raises:
        StoreError: It cannot be read.
        UsageError: It is a config or a plan; or it has no config to print.
    """
    if kind in (Kind.CONFIG, Kind.PLAN, Kind.YAML):
        check = f"heck it: rbstab check {shell_word(path)}"
        way = f". C{check}" if kind is Kind.YAML else f"; or c{check}"
        raise click.UsageError(not_a_result(path, kind) + way)
    if as_config:
        raise click.UsageError(f"{path} is {kind.words}; only a run has a config to print")
    if kind is Kind.PART:
        raise NotAResultError(not_a_result(path, kind))
    if kind is Kind.FOLDER:
        return list_results(path, as_json)
    if kind is Kind.SWEEP:
        _show_sweep(sweep_folder_of(path), as_json=as_json)
    elif kind is Kind.PROOFS:
        _show_proofs(path, as_json=as_json)
    else:
        _show_proof(path, as_json=as_json)
    return None


def _show_proofs(path: Path, *, as_json: bool) -> None:
    """Print what the proofs in a folder say."""
    # The parent of a relative path `proofs` is the working folder.
    rows = proof_rows(path.absolute().parent)
    if as_json:
        print_json(rows)
    elif not rows:
        say(f"{path} has no stored proofs.")
    else:
        click.echo(f"{path}: stored proofs")
        columns = tuple(rows[0])
        table = Table(*columns, words=columns[:1])
        for row in rows:
            table.add(*row.values())
        table.print()


def _show_proof(path: Path, *, as_json: bool) -> None:
    """Print the sentences of a proof of any kind, by its file's name."""
    said = what_it_says(path)
    facts = {"kind": said.kind, "statements": said.sentences, "id": said.id}
    if as_json:
        print_json(facts | {"seconds": said.seconds})
        return
    names = ["statements", *[""] * (len(said.sentences) - 1)]
    statements = zip(names, said.sentences, strict=True)
    ends = [("id", said.id), ("seconds", str(said.seconds))]
    print_facts([("kind", said.kind), *statements, *ends])


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
