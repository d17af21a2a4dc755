"""Folders of results, printed as a table or as JSON."""

import time
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from rbstab_cli.output.stored.unread_proofs import print_unread_proofs, results_folder_of

if TYPE_CHECKING:
    from rbstab.listing.folder import Entry


def report_entries(folder: Path, *, as_json: bool) -> int:
    """Print the runs and sweeps in a folder; return how many of them cannot be read.

    Raises:
        StoreError: The folder cannot be read.
    """
    from rbstab.config.errors import printable
    from rbstab.files.shell_words import shell_word
    from rbstab.listing.folder import entries_of, listed_folder, proofs_in

    entries = entries_of(folder)
    print_unread_proofs([results_folder_of(folder)])
    unread = [entry for entry in entries if entry.problem]
    if as_json:
        from rbstab_cli.output.json_output import print_json

        print_json([_data(entry) for entry in entries])
        return len(unread)
    _print_table([entry for entry in entries if not entry.problem])
    for entry in unread:
        click.echo(printable(entry.problem), err=True)
    if not entries:
        _print_empty(folder)
    inside = listed_folder(folder)
    count = len(proofs_in(inside))
    if count:
        # They may also say that nothing is proved.
        proofs = inside / "proofs"
        files = f"{count} file{'s' if count > 1 else ''}"
        click.echo(f"{proofs} has {files}; rbstab show {shell_word(proofs)} prints what is proved.")
    return len(unread)


def _print_empty(folder: Path) -> None:
    """Say that a folder has no results, and what may be done."""
    from rbstab.files.shell_words import shell_word
    from rbstab.listing.folder import FIRST
    from rbstab.listing.inner_folders import inner_folder

    kind = inner_folder(folder)
    what = f"It has {kind}: rbstab show {shell_word(folder)}" if kind else FIRST
    click.echo(f"{folder} has no runs and no sweeps. {what}.", err=True)


def _print_table(entries: "list[Entry]") -> None:
    from rbstab.experiment.answers.words import word_of
    from rbstab_cli.output.tables import add_row, new_table, print_table

    if not entries:
        return
    words = ("kind", "outcome", "status", "checks", "this start", "whole range")
    table = new_table("name", *words, "age", "title", words=words, numbers=("age",))
    now = time.time()
    for entry in entries:
        cells = (
            *(entry.outcome, entry.status, word_of(entry.verdict)),
            *(entry.this_start, entry.whole_range),
        )
        old = age(now - entry.modified)
        add_row(table, str(entry.path), entry.kind, *cells, old, entry.title)
    print_table(table)


def age(seconds: float) -> str:
    """Return a time since something as a whole number of its largest unit: 3 min, 5 h, 12 d."""
    for unit, size in (("d", 86400), ("h", 3600), ("min", 60)):
        if seconds >= size:
            return f"{int(seconds // size)} {unit}"
    return f"{max(int(seconds), 0)} s"


def _data(entry: "Entry") -> dict[str, Any]:
    modified = datetime.fromtimestamp(entry.modified, UTC).isoformat(timespec="seconds")
    from rbstab.experiment.answers.words import word_of

    data = entry._asdict() | {"path": str(entry.path), "kind": str(entry.kind)}
    data["checks"] = word_of(entry.verdict)
    return data | {"modified": modified, "problem": entry.problem or None}
