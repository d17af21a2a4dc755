"""How two runs, or two sweeps, differ: in what was run, and in what came out."""

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from rbstab.analysis.lyapunov import ENERGY_SCALE
from rbstab.config.errors import ConfigError
from rbstab.config.source import parse_source
from rbstab.experiment.answers.run_answer import answer_of
from rbstab.experiment.answers.words import word_of
from rbstab.experiment.convergence.with_proof import known_now
from rbstab.experiment.summary import at_least, at_rest_from, lyapunov_function_of
from rbstab.listing.folder import checked_content, only_result
from rbstab.report.model.words import NO_VALUE, number, untrusted
from rbstab.report.reading.sources import Run, SweepFile, read_sources
from rbstab.report.runs.config_tables import flat, value_text, with_unit
from rbstab.store.errors import StoreError
from rbstab.sweep.folder.member_answers import member_answers
from rbstab.sweep.folder.sweep_table import read_sweep

Outcome = dict[str, float | str]
"""What came out of a run or a sweep: numbers or texts by their names with units."""


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

RESIDUAL = f"largest |r| / {ENERGY_SCALE}"

NO_RATIO = ("reached [s]", RESIDUAL)
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
    (first, second), (one, other) = inputs, outcomes
    same = all(first.get(section) == second.get(section) for section in SYSTEM)
    without = NO_RATIO if same else (*NO_RATIO, *V_ROWS)
    return Comparison(kind, _inputs(first, second), _rows(one, other, without), same)


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
        one, other = first.get(name, NO_VALUE), second.get(name, NO_VALUE)
        ratio = ""
        if isinstance(one, float) and isinstance(other, float) and one and name not in without:
            ratio = number(other / one, 3)
        rows.append(Row(name, _text(one), _text(other), ratio))
    return rows


def _text(value: float | str) -> str:
    return number(value, 5) if isinstance(value, float) else untrusted(value)


def _of_run(run: Run) -> Outcome:
    result, s = run.result, run.summary
    with checked_content(run.path):
        known = known_now(run.path, result, run.config)
        answer = answer_of(known.result, known.config, known.proof)
    return {
        "outcome": answer.outcome.sentence,
        "run id": result.run_id,
        "status": result.status,
        "checks": word_of(str(result.attributes.get("verdict", NO_VALUE))),
        "this start comes to rest": answer.this_start.word,
        "whole range": answer.whole_range.word,
        "reached [s]": s.end_time,
        "v(0) [J]": s.lyapunov_start,
        # The result may store v - ε, which does not end at zero.
        "v(end) [J]": float(lyapunov_function_of(result)[-1]),
        "at rest from [s]": _settling(run),
        "largest |E| [m]": _peak(s.peak_distance, resolved=s.displacement_resolved),
        "largest |θ2| [rad]": _peak(s.largest_pitch, resolved=s.pitch_resolved),
        RESIDUAL: s.relative_residual,
    }


def _settling(run: Run) -> float | str:
    """Return the settling time; as text, which has no ratio, if the samples do not resolve it."""
    text = at_rest_from(run.result)
    return text if text.startswith("≤") else run.settling_time


def _peak(value: float, *, resolved: bool) -> float | str:
    """Return a peak; as text, which has no ratio, if the true one may be larger."""
    return value if resolved else at_least(resolved) + _text(value)


def _of_sweep(sweep: SweepFile) -> Outcome:
    answers = member_answers(sweep.path)
    found, outcomes = answers.summary, answers.outcomes
    return {
        "outcome": outcomes.sentence,
        "decides": outcomes.deciding or NO_VALUE,
        "members": str(answers.members),
        **{f"members {status}": str(count) for status, count in found["by_status"].items()},
        **{
            f"members: come to rest, {word}": f"{count} of {answers.members}"
            for word, count in answers.by_word.items()
        },
        "members that settled": str(answers.settled),
        "settling time, median [s]": found["settling_median"],
        RESIDUAL: found["worst_residual"],
    }


def _plan_of(sweep: SweepFile) -> dict[str, Any]:
    """Return the plan in the file of a sweep; empty if it cannot be read."""
    table = read_sweep(sweep.path, ())
    try:
        data = parse_source(str(table["plan"]), "plan").data
    except (ConfigError, KeyError):
        return {}
    return data if isinstance(data, dict) else {}
