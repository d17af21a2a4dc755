"""The answers of runs, printed: what is known about stability, and how surely."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import click

from rbstab.config.schema import Config
from rbstab.experiment.answers.run_answer import RunAnswer
from rbstab.experiment.answers.wanted import wanted
from rbstab_cli.output.warnings import print_result_warnings
from rbstab_cli.printing import Table

COLOURS = {"false": "red", "not decided": "yellow"}
"""Colours of the words on a terminal. Green is the outcome of a body that rests where it should."""

MAX_SENTENCES = 10
"""The answers of more runs are printed as words only."""

MAX_WIDTH = 160
"""The most characters of the names of files that share an answer."""

QUESTIONS = {"this_start": "This start", "whole_range": "Whole range", "pushes": "Pushes"}
"""What the sentences of an answer are about."""

Answered = tuple[Path, Config | None, RunAnswer]
"""The file of a run, its config and its answer."""


def print_statement(name: str, text: str) -> None:
    """Print a sentence after its name, below the others."""
    click.echo(f"  {name + ':':<13}{text}.")


def print_answer(answer: RunAnswer, config: Config | None) -> None:
    """Print the answers of a run: its outcome, what is wanted, and a line for each question."""
    fg = "green" if answer.outcome.is_good else None
    print_statement("Outcome", click.style(answer.outcome.sentence, fg=fg))
    print_statement("Desired", str(wanted(config)))
    for name, found in answer.answers.items():
        word = click.style(f"{found.sureness}:", fg=COLOURS.get(str(found.sureness)))
        print_statement(QUESTIONS[name], f"{word} {found.sentence}")


def print_answers(answers: Sequence[Answered], warnings: Mapping[Path, Sequence[str]]) -> None:
    """Print the answers of several runs: a table of their words, then their sentences.

    Answers that several runs share are printed once. The warnings of a run follow its answer, on
    stderr.

    Args:
        answers: The answers.
        warnings: The warnings by the files of the runs.
    """
    if len(answers) > 1:
        _print_words(answers)
    shared: dict[RunAnswer, dict[Path, Config | None]] = {}
    for path, config, answer in answers:
        shared.setdefault(answer, {})[path] = config
    if len(shared) > MAX_SENTENCES:
        click.echo("rbstab show FILE says why.")
    for answer, runs in shared.items():
        if len(shared) <= MAX_SENTENCES:
            click.echo(_named(list(runs)))
            print_answer(answer, next(iter(runs.values())))
        for path in runs:
            print_result_warnings(path, warnings[path])


def _named(paths: Sequence[Path]) -> str:
    """Return the names of files, as many as fit into `MAX_WIDTH`, and how many more there are."""
    shown = str(paths[0])
    for number, path in enumerate(paths[1:], 1):
        if len(shown) + len(str(path)) > MAX_WIDTH:
            return f"{shown} and {len(paths) - number} more"
        shown += f", {path}"
    return shown


def _print_words(answers: Sequence[Answered]) -> None:
    words = ("outcome", "this start comes to rest", "whole range")
    table = Table("file", *words, words=words)
    for path, _, answer in answers:
        sure = (found.word for found in (answer.this_start, answer.whole_range))
        style = "green" if answer.outcome.is_good else None
        table.add(str(path), answer.outcome.brief, *sure, style=style)
    table.print()
