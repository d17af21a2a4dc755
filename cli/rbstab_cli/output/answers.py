"""The answers of runs, printed: what is known about stability, and how surely."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from rbstab_cli.output.result_warnings import print_result_warnings

if TYPE_CHECKING:
    from rbstab.config.schema import Config
    from rbstab.experiment.answers.run_answer import RunAnswer

COLOURS = {"false": "red", "not decided": "yellow"}
"""Colours of the words on a terminal. Green is the outcome of a body that rests where it should."""

MAX_SENTENCES = 10
"""The answers of more runs are printed as words only."""


MAX_WIDTH = 160
"""The most characters of the names of files that share an answer."""

QUESTIONS = {"this_start": "This start", "whole_range": "Whole range", "pushes": "Pushes"}
"""What the sentences of an answer are about."""


def print_answer(answer: "RunAnswer", config: "Config | None") -> None:
    """Print the answers of a run: its outcome, what is wanted, and a line for each question."""
    from rbstab.experiment.answers.wanted import wanted

    outcome = click.style(answer.outcome.sentence, fg="green" if answer.outcome.is_good else None)
    click.echo(f"  {'Outcome:':<13}{outcome}.")
    click.echo(f"  {'Desired:':<13}{wanted(config)}.")
    for name, found in answer.answers.items():
        word = click.style(f"{found.sureness}:", fg=COLOURS.get(str(found.sureness)))
        click.echo(f"  {QUESTIONS[name] + ':':<13}{word} {found.sentence}.")


def print_answers(
    answers: "Sequence[tuple[Path, Config | None, RunAnswer]]",
    warnings: Mapping[Path, Sequence[str]],
) -> None:
    """Print the answers of several runs: a table of their words, then their sentences.

    Answers that several runs share are printed once. The warnings of a run follow its answer, on
    stderr.

    Args:
        answers: The answers.
        warnings: The warnings by the files of the runs.
    """
    if len(answers) > 1:
        _print_words(answers)
    shared: dict[RunAnswer, list[Path]] = {}
    for path, _, answer in answers:
        shared.setdefault(answer, []).append(path)
    if len(shared) > MAX_SENTENCES:
        click.echo("rbstab show FILE says why.")
        for path, _, _ in answers:
            print_result_warnings(path, warnings[path])
        return
    configs = {path: config for path, config, _ in answers}
    for answer, paths in shared.items():
        click.echo(named(paths))
        print_answer(answer, configs[paths[0]])
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


def _print_words(answers: "Sequence[tuple[Path, Config | None, RunAnswer]]") -> None:
    from rbstab_cli.output.tables import add_row, new_table, print_table

    words = ("outcome", "this start comes to rest", "whole range")
    table = new_table("file", *words, words=words)
    for path, _, answer in answers:
        sure = (found.word for found in (answer.this_start, answer.whole_range))
        style = "green" if answer.outcome.is_good else None
        add_row(table, str(path), answer.outcome.brief, *sure, style=style)
    print_table(table)
