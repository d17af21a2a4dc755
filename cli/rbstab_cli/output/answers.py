"""The answers of runs, printed: what is known about stability, and how surely."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from rbstab_cli.output.result_warnings import print_result_warnings

if TYPE_CHECKING:
    from rbstab.experiment.answers.run_answer import RunAnswer

COLOURS = {"proved": "green", "false": "red", "not decided": "yellow"}
"""Colours of the words on a terminal; "seen" has none."""

MAX_SENTENCES = 10
"""The answers of more runs are printed as words only."""


MAX_WIDTH = 160
"""The most characters of the names of files that share an answer."""


def print_answer(answer: "RunAnswer") -> None:
    """Print the answers of a run, a line for each question."""
    for question, found in (
        ("This start", answer.this_start),
        ("Whole range", answer.whole_range),
    ):
        word = click.style(f"{found.sureness}:", fg=COLOURS.get(str(found.sureness)))
        click.echo(f"  {question + ':':<13}{word} {found.sentence}.")


def print_answers(
    answers: "list[tuple[Path, RunAnswer]]", warnings: Mapping[Path, Sequence[str]]
) -> None:
    """Print the answers of several runs: a table of their words, then their sentences.

    Answers that several runs share are printed once. The warnings of a run follow its answer, on
    stderr.

    Args:
        answers: The answers by the files of the runs.
        warnings: The warnings by the files of the runs.
    """
    if len(answers) > 1:
        _print_words(answers)
    shared: dict[RunAnswer, list[Path]] = {}
    for path, answer in answers:
        shared.setdefault(answer, []).append(path)
    if len(shared) > MAX_SENTENCES:
        click.echo("rbstab show FILE says why.")
        for path, _ in answers:
            print_result_warnings(path, warnings[path])
        return
    for answer, paths in shared.items():
        click.echo(named(paths))
        print_answer(answer)
        for path in paths:
            print_result_warnings(path, warnings[path])


def named(paths: Sequence[Path]) -> str:
    """Return the names of files, as many as fit into `MAX_WIDTH`, and how many more there are."""
    shown = str(paths[0])
    for number, path in enumerate(paths[1:], 1):
        if len(shown) + len(str(path)) > MAX_WIDTH:
            return f"{shown} and {len(paths) - number} more"
        shown += f", {path}"
    return shown


def _print_words(answers: "list[tuple[Path, RunAnswer]]") -> None:
    from rbstab_cli.output.tables import add_row, new_table, print_table

    words = ("this start comes to rest", "whole range")
    table = new_table("file", *words, words=words)
    for path, answer in answers:
        add_row(table, str(path), *(found.word for found in answer))
    print_table(table)
