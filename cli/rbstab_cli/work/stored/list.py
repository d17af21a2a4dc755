"""`rbstab list`: folders of results, as a table or as JSON."""

import time
from datetime import UTC, datetime
from pathlib import Path

import click

from rbstab.experiment.answers.words import word_of
from rbstab.files.text import printable, shell_word
from rbstab.listing.folder import FIRST, Entry, entries_of, listed_folder, proofs_in
from rbstab.report.model.words import counted
from rbstab.report.reading.kinds import Kind, kind_of
from rbstab_cli import exit_codes
from rbstab_cli.output.runs import print_unread_proofs
from rbstab_cli.printing import Table, print_json, say
from rbstab_cli.results import results_folder_of


def list_results(folder: Path, as_json: bool) -> int:
    """Print the runs and sweeps in a folder; the exit code tells if one cannot be read."""
    entries = entries_of(folder)
    print_unread_proofs([results_folder_of(folder)])
    unread = [entry for entry in entries if entry.problem]
    code = exit_codes.STORAGE if unread else exit_codes.OK
    if as_json:
        print_json(
            [
                {
                    **entry._asdict(),
                    "path": str(entry.path),
                    "checks": word_of(entry.verdict),
                    "modified": datetime.fromtimestamp(entry.modified, UTC).isoformat(
                        timespec="seconds"
                    ),
                    "problem": entry.problem or None,
                }
                for entry in entries
            ]
        )
        return code
    _print_table([entry for entry in entries if not entry.problem])
    for entry in unread:
        say(printable(entry.problem))
    if not entries:
        shown = f"It has stored proofs: rbstab show {shell_word(folder)}"
        what = shown if kind_of(folder) is Kind.PROOFS else FIRST
        say(f"{folder} has no runs and no sweeps. {what}.")
    inside = listed_folder(folder)
    proofs = inside / "proofs"
    count = len(proofs_in(inside))
    if count:
        # They may also say that nothing is proved.
        way = f"rbstab show {shell_word(proofs)} prints what is proved."
        click.echo(f"{proofs} has {counted(count, 'file')}; {way}")
    return code


def _print_table(entries: list[Entry]) -> None:
    if not entries:
        return
    words = ("kind", "outcome", "status", "checks", "this start", "whole range")
    table = Table("name", *words, "age", "title", words=words, numbers=("age",))
    now = time.time()
    for entry in entries:
        said = (entry.outcome, entry.status, word_of(entry.verdict))
        sure = (entry.this_start, entry.whole_range)
        old = age(now - entry.modified)
        table.add(str(entry.path), entry.kind, *said, *sure, old, entry.title)
    table.print()


def age(seconds: float) -> str:
    """Return a time since something as a whole number of its largest unit: 3 min, 5 h, 12 d."""
    for unit, size in (("d", 86400), ("h", 3600), ("min", 60)):
        if seconds >= size:
            return f"{int(seconds // size)} {unit}"
    return f"{max(int(seconds), 0)} s"
