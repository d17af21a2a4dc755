"""How two runs, or two sweeps, differ: in what was run, and in what came out."""

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from rbstab.analysis.lyapunov import ENERGY_SCALE
from rbstab.config.errors import ConfigError
from rbstab.config.source import parse_source
from rbstab.experiment.answers.facts import FACTS, Shown
from rbstab.experiment.answers.rounded import NO_VALUE, number
from rbstab.files.text import grouped
from rbstab.listing.folder import checked_content, only_result
from rbstab.report.model.words import untrusted
from rbstab.report.reading.sources import Run, SweepFile, read_sources
from rbstab.report.runs.config_tables import flat, value_text, with_unit
from rbstab.store.errors import StoreError
from rbstab.sweep.folder.member_answers import SWEEP_FACTS, member_answers
from rbstab.sweep.folder.sweep_table import read_sweep

Outcome = dict[str, Shown]
"""What came out of a run or a sweep, by names with units."""

NOTHING = Shown(NO_VALUE)

COMPARED = (
    *("outcome", "tilt", "run id", "status", "checks", "this start", "whole range"),
    *("time reached", "v(0)", "v(end)", "at rest from", "peak |E|", "peak |θ2|"),
    f"|r|/{ENERGY_SCALE}",
)
"""The facts about both runs."""


class Row(NamedTuple):
    """A quantity with its values in both results; ratio is the second over the first, or empty."""

    name: str
    first: str
    second: str
    ratio: str = ""


class Comparison(NamedTuple):
    """The differences of two results.

    Attributes:
        kind: "run" or "sweep".
        inputs: The keys of the config, or of the plan, that differ.
        outcomes: What came out, also where it is equal.
        same_system: Whether body, gravity, controller and elements are equal. If not, v is another
            function in each result, so that its values have no ratio.
    """

    kind: str
    inputs: list[Row]
    outcomes: list[Row]
    same_system: bool


SYSTEM = ("body", "gravity", "controller", "elements")
"""The sections of a config that v depends on."""

V_ROWS = ("v(0) [J]", "v(end) [J]")

NO_RATIO = ("time reached [s]", "tilt [°]")
"""Numbers whose ratio says nothing."""


def compare(first: Path, second: Path) -> Comparison:
    """Compare two results. A folder with one result in it stands for this result.

    Raises:
        StoreError: One of them cannot be read; a folder has no result or several; or one is a run
            and the other a sweep.
    """
    first, second = only_result(first), only_result(second)
    sources = [read_sources([path]) for path in (first, second)]
    for source in sources:
        for unread in source.unread:
            raise StoreError(f"{unread.path}: {unread.reason}")
    runs = [run for source in sources for run in source.runs]
    sweeps = [sweep for source in sources for sweep in source.sweeps]
    if len(runs) == 2:
        return _comparison("run", [run.data for run in runs], [_of_run(run) for run in runs])
    if len(sweeps) == 2:
        return _comparison("sweep", list(map(_plan_of, sweeps)), list(map(_of_sweep, sweeps)))
    kinds = ("a run", "a sweep") if sources[0].runs else ("a sweep", "a run")
    raise StoreError(
        f"{first} is {kinds[0]} and {second} is {kinds[1]}, which have no common outcomes; compare "
        "two runs or two sweeps"
    )


def _comparison(
    kind: str, inputs: Sequence[Mapping[str, Any]], outcomes: Sequence[Outcome]
) -> Comparison:
    (first, second), (left, right) = inputs, outcomes
    same = all(first.get(section) == second.get(section) for section in SYSTEM)
    without = NO_RATIO if same else (*NO_RATIO, *V_ROWS)
    return Comparison(kind, _inputs(first, second), _rows(left, right, without), same)


def _inputs(first: Mapping[str, Any], second: Mapping[str, Any]) -> list[Row]:
    """Return the keys that differ between two configs or plans."""
    a, b = flat(first), flat(second)
    configs = {"first": a, "second": b}
    return [
        Row(with_unit(key, configs), value_text(a.get(key)), value_text(b.get(key)))
        for key in dict.fromkeys((*a, *b))
        if a.get(key) != b.get(key)
    ]


def _rows(first: Outcome, second: Outcome, without: Collection[str]) -> list[Row]:
    """Return the outcomes beside each other, without a ratio of those in `without`."""
    rows = []
    for name in dict.fromkeys((*first, *second)):
        left, right = first.get(name, NOTHING), second.get(name, NOTHING)
        ratio = ""
        if left.is_number and right.is_number and name not in without and left.value:
            ratio = number((right.value or 0.0) / left.value, 3)
        rows.append(Row(name, _text(left), _text(right), ratio))
    return rows


def _text(shown: Shown) -> str:
    """Return a number with five digits; what says more than its number stays as it is."""
    return number(shown.value or 0.0, 5) if shown.is_number else untrusted(shown.text)


def _of_run(run: Run) -> Outcome:
    with checked_content(run.path):
        return {fact.head: fact.of(run) for fact in map(FACTS.__getitem__, COMPARED)}


def _of_sweep(sweep: SweepFile) -> Outcome:
    answers = member_answers(sweep.path)
    counts = {f"members {status}": n for status, n in answers.summary["by_status"].items()}
    counts |= {f"members: come to rest, {word}": n for word, n in answers.by_word.items()}
    of = f"of {grouped(answers.members)}"
    return {fact.head: fact.of(answers) for fact in SWEEP_FACTS.values()} | {
        name: Shown(f"{grouped(count)} {of}") for name, count in counts.items()
    }


def _plan_of(sweep: SweepFile) -> dict[str, Any]:
    """Return the plan in the file of a sweep; empty if it cannot be read."""
    table = read_sweep(sweep.path, ())
    try:
        data = parse_source(str(table["plan"]), "plan").data
    except (ConfigError, KeyError):
        return {}
    return data if isinstance(data, dict) else {}
