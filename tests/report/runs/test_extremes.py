"""Protects figures of many runs: the extremes have colours, the others are grey and one entry."""

from pathlib import Path

import pytest
from support.figure_runs import lines_of
from support.made_runs import made_result
from support.sections import figures_in

from rbstab.experiment.summary import summary_of
from rbstab.report.model.figure import MUTED
from rbstab.report.reading.sources import Run
from rbstab.report.runs.figures.extremes import MAX_CURVES, MOST_COLOURED, extremes_in_colour
from rbstab.report.runs.sections import figures_section
from rbstab.report.writers.vega.specification import specification
from rbstab.store.result import Result

COUNT = 9


def made_run(number, *, rest=1.0, peak=0.1, status="completed", end=3.0):
    """Return a run of the made motion with another settling time, peak and end."""
    result = made_result(status=status)
    summary = summary_of(result)._replace(peak_distance=peak, end_time=end)
    run = Run(
        Path(f"r{number}.h5"),
        Result(result.variables, result.attributes, result.config),
        None,
        number=number,
        name=f"run-{number + 1}",
        label=f"r{number}",
    )
    run.summary, run.settling_time = summary, rest
    return run


def made_runs():
    """Return nine runs: r2 is first at rest, r5 last, r1 has the smallest peak, r7 the largest."""
    rests = [1.0, 1.1, 0.5, 1.2, 1.3, 1.9, 1.4, 1.5, 1.6]
    peaks = [0.2, 0.1, 0.3, 0.3, 0.3, 0.3, 0.3, 0.9, 0.3]
    return [made_run(k, rest=rests[k], peak=peaks[k]) for k in range(COUNT)]


def test_few_runs_have_a_colour_each():
    runs = made_runs()[:MOST_COLOURED]
    assert extremes_in_colour(runs) == (tuple(runs), "")


def test_of_many_runs_only_the_extremes_are_drawn():
    runs = [made_run(k, rest=1.0 + k) for k in range(MAX_CURVES + 1)]
    looks, sentence = extremes_in_colour(runs)
    assert [(run.label, run.number) for run in looks] == [("r0", 0), (f"r{MAX_CURVES}", 1)]
    assert sentence.startswith(f"Of {len(runs)} runs, the figures show the extremes: r0 (first at")
    assert len(extremes_in_colour(runs[:-1])[0]) == MAX_CURVES


NEVER = float("nan")
EARLY = {"rest": NEVER, "status": "range left"}


@pytest.mark.parametrize(
    ("changes", "coloured", "words"),
    [
        ({}, {"r2", "r5", "r7"}, "r2 (first at rest), r5 (last at rest), r7 (largest peak of |E|)"),
        ({2: {"rest": 0.5, "peak": 1.0}}, {"r2", "r5"}, "r2 (first at rest, largest peak of |E|)"),
        # Of those that ended early, the two that ended first.
        (
            {0: {**EARLY, "end": 0.3}, 3: {**EARLY, "end": 0.2}, 4: {**EARLY, "end": 0.9}},
            {"r0", "r2", "r3", "r5", "r7"},
            "r0 (ended early), r2 (first at rest), r3 (ended early)",
        ),
        ({6: {"rest": NEVER}}, {"r2", "r6", "r7"}, "r6 (not at rest by its end)"),
        # Where all contact points are held, |E| is round-off.
        ({k: {"rest": 1.0 + k, "peak": 1e-15} for k in range(COUNT)}, {"r0", "r8"}, "r8 (last at"),
    ],
)
def test_the_extremes_are_coloured_and_named(changes, coloured, words):
    runs = [made_run(k, **changes[k]) if k in changes else run for k, run in enumerate(made_runs())]
    looks, sentence = extremes_in_colour(runs)
    assert {run.label: run.number for run in looks if not run.legend} == {
        label: number for number, label in enumerate(sorted(coloured))
    }
    assert words in sentence
    assert sentence.endswith(f"The {COUNT - len(coloured)} other runs are grey.")


@pytest.fixture(scope="module")
def sections():
    return [figures_section(made_runs())]


def test_grey_curves_are_behind_and_keep_their_names(sections):
    for panel in figures_in(sections)["runs-decay"].panels:
        lines = lines_of(panel)
        assert {line.label for line in lines} == {f"r{k}" for k in range(COUNT)}
        assert [line.group for line in lines] == ["6 other runs"] * 6 + [""] * 3
        assert all(line.colour == MUTED for line in lines if line.group)


def test_the_pointer_names_each_run(sections):
    layers = specification(figures_in(sections)["runs-decay"], width=800.0)["vconcat"][1]
    rows = [
        row
        for panel in layers["concat"]
        for layer in panel["layer"]
        for row in layer["data"]["values"]
    ]
    named = {row.get("text", row["series"]) for row in rows if "series" in row}
    assert named == {f"r{k}" for k in range(COUNT)}
