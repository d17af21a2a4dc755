"""What is printed of runs: answers, checks of certificates, warnings; and their plain data."""

import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import click

from rbstab.config.schema import Config
from rbstab.config.warnings import config_warnings
from rbstab.experiment.answers.assessed_run import AssessedRun
from rbstab.experiment.answers.check_words import comparison, word_of_check
from rbstab.experiment.answers.facts import FACTS
from rbstab.experiment.answers.rounded import number
from rbstab.experiment.answers.run_answer import RunAnswer
from rbstab.experiment.answers.wanted import wanted
from rbstab.experiment.convergence.convergence import ATTRIBUTE
from rbstab.experiment.proof_cache import why_unreadable
from rbstab.experiment.stored_run import certificate_lines
from rbstab.store.result import Result
from rbstab_cli.printing import Table, say

COLOURS = {"bad": "red", "warning": "yellow", "good": "green"}
"""Colours of facts on a terminal by their tones, the most urgent ones first."""

COLOURS_OF_ANSWERS = {"false": "red", "not decided": "yellow"}
"""Colours of the words on a terminal. Green is the outcome of a body that rests where it should."""

MAX_SENTENCES = 10
"""The answers of more runs are printed as words only."""

MAX_WIDTH = 160
"""The most characters of the names of files that share an answer."""

QUESTIONS = {
    "this_start": "This start",
    "whole_range": "Whole range",
    "pushes": "Pushes",
    "bound": "Bound",
}
"""What the sentences of an answer are about."""

VIOLATED = "violated"
"""The verdict of a check that is not met."""


def print_statement(name: str, text: str) -> None:
    """Print a sentence after its name, below the others."""
    click.echo(f"  {name + ':':<13}{text}.")


def print_answer(run_answer: RunAnswer, config: Config | None) -> None:
    """Print the answers of a run: its outcome, what is wanted, and a line for each question."""
    fg = "green" if run_answer.outcome.is_good else None
    print_statement("Outcome", click.style(run_answer.outcome.sentence, fg=fg))
    print_statement("Desired", str(wanted(config)))
    for name, answer in run_answer.answers.items():
        word = click.style(f"{answer.sureness}:", fg=COLOURS_OF_ANSWERS.get(str(answer.sureness)))
        print_statement(QUESTIONS[name], f"{word} {answer.sentence}")


def print_answers(
    runs: Sequence[AssessedRun], warnings: Mapping[Path, Sequence[str]], command: str
) -> None:
    """Print the answers of several runs: a table of their words, then their sentences.

    Answers that several runs share are printed once. The warnings of a run follow its answer, on
    stderr.

    Args:
        runs: The runs.
        warnings: The warnings by the files of the runs.
        command: The command that makes a proof, as the answers name it.
    """
    if len(runs) > 1:
        print_run_table(runs, ("outcome", "this start", "whole range"), ())
    shared: dict[RunAnswer, dict[Path, Config | None]] = {}
    for run in runs:
        shared.setdefault(run.answer.naming(command), {})[run.path] = run.config
    if len(shared) > MAX_SENTENCES:
        click.echo("rbstab show FILE says why.")
    for answer, files in shared.items():
        if len(shared) <= MAX_SENTENCES:
            click.echo(_named(list(files)))
            print_answer(answer, next(iter(files.values())))
        for path in files:
            print_result_warnings(path, warnings.get(path, ()))


def _named(paths: Sequence[Path]) -> str:
    """Return the names of files, as many as fit into `MAX_WIDTH`, and how many more there are."""
    shown = str(paths[0])
    for named, path in enumerate(paths[1:], 1):
        if len(shown) + len(str(path)) > MAX_WIDTH:
            return f"{shown} and {len(paths) - named} more"
        shown += f", {path}"
    return shown


def print_run_table(
    runs: Sequence[AssessedRun], words: Sequence[str], numbers: Sequence[str], note: str = ""
) -> None:
    """Print a row for each run: its file and some of its facts, which are words or numbers.

    Args:
        runs: The runs.
        words: The names of the facts that are words (see `FACTS`). They come first, and colour the
            row.
        numbers: The names of the facts that are numbers.
        note: A line below the table.
    """
    facts = [FACTS[name] for name in (*words, *numbers)]
    heads = [fact.head for fact in facts]
    table = Table("file", *heads, words=heads[: len(words)], numbers=heads[len(words) :])
    for run in runs:
        shown = [fact.of(run) for fact in facts]
        tones = {COLOURS.get(cell.tone) for cell in shown[: len(words)]}
        style = next((colour for colour in COLOURS.values() if colour in tones), None)
        table.add(str(run.path), *(cell.text for cell in shown), style=style)
    table.print(note)


def certificate_checks(result: Result) -> list[dict[str, Any]]:
    """Return the checks of the certificate; none if the result has no certificate.

    `word` says how sure each is, as in the table.
    """
    return [{**line._asdict(), "word": word_of_check(line)} for line in certificate_lines(result)]


def print_certificate(result: Result) -> None:
    """Print the checks as a table."""
    lines = certificate_lines(result)
    table = Table("check", "how sure", "what is compared", "found", "at [s]")
    for line in lines:
        when = number(line.when) if not math.isnan(line.when) else "-"
        style = "red" if line.verdict == VIOLATED else None
        cells = (word_of_check(line), line.quantity, comparison(line), when)
        table.add(line.check, *cells, style=style)
    if lines:
        table.print()


def run_data(run: AssessedRun) -> dict[str, Any]:
    """Return the outcome of a run, its attributes, summary, answers and convergence."""
    attributes, run_answer, convergence = run.now.attributes, run.answer, run.convergence
    data: dict[str, Any] = {"outcome": run_answer.outcome.as_data()} | {
        name: value for name, value in attributes.items() if name.partition("_")[0] != ATTRIBUTE
    }
    data["checks"] = FACTS["checks"].of(run).text
    data["warnings"] = str(data.get("warnings", "")).splitlines()
    data[ATTRIBUTE] = None if convergence is None else convergence.as_data()
    data["answers"] = {
        question: {"word": str(answer.sureness), "sentence": answer.sentence}
        for question, answer in run_answer.answers.items()
    }
    return {**data, **run.summary._asdict(), "settling_time": run.settling_time}


def run_warnings(result: Result, config: Config) -> list[str]:
    """Return the warnings of a result, without those about its config.

    A command that reads a config prints the warnings about it at once.
    """
    of_config = config_warnings(config)
    stored = str(result.attributes.get("warnings", "")).splitlines()
    return [warning for warning in stored if warning not in of_config]


def print_result_warnings(path: Path, warnings: Sequence[str]) -> None:
    """Print the warnings of the result in a file."""
    for warning in warnings:
        say(f"warning: {path}: {warning}")


def print_unread_proofs(folders: Iterable[Path]) -> None:
    """Print for each folder of results why its proofs cannot be read; nothing if they can be."""
    for folder in dict.fromkeys(folders):
        reason = why_unreadable(folder)
        if reason:
            say(f"warning: {reason}. The results are shown without them.")
