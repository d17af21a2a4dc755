"""Protects the choice of tests: each target of make takes what it says, and CI takes them all."""

import json
import re
from itertools import product
from pathlib import Path

import pytest
from _pytest.mark.expression import Expression

from support import measure
from support.tiers import (
    LIMITS,
    LONGEST,
    mark_by_time,
    order_files,
)

ROOT = Path(__file__).parents[2]

MARKERS = ("slow", "heavy", "long")


class Collected:
    """A collected test, as far as its marks are concerned."""

    def __init__(self, node_id, **params):
        self.nodeid, self.marks = node_id, set()
        if params:
            self.callspec = type("CallSpec", (), {"params": params})()

    def add_marker(self, marker):
        self.marks.add(marker.name)


def chosen_by(target):
    """Return the sets of markers whose tests a target of make runs where there is a browser."""
    recipe = (ROOT / "Makefile").read_text().partition(f"\n{target}: $(READY)")[2]
    match = re.search(r"-m '(.*?)'", recipe)
    assert match is not None
    given = match.group(1)
    expression = given.replace("$(AND_BROWSERLESS)", "").replace("$(BROWSERLESS)", "")
    every = [
        {name for name, there in zip(MARKERS, flags, strict=True) if there}
        for flags in product((False, True), repeat=3)
    ]
    if not expression:
        return every
    return [marks for marks in every if is_chosen(expression, marks)]


def is_chosen(expression, marks):
    def has(name, /, **_):
        return name in marks

    return Expression.compile(expression).evaluate(has)


def test_what_runs_for_every_change_is_all_but_the_long_tests():
    commands = (ROOT / ".ci" / "run").read_text().splitlines()
    targets = [line.split()[1] for line in commands if line.startswith("make test")]
    assert targets == ["test", "test-heavy"]
    chosen = [marks for target in targets for marks in chosen_by(target)]
    expected = [marks for marks in chosen_by("test-long") if "long" not in marks]
    assert sorted(map(sorted, chosen)) == sorted(map(sorted, expected))


def test_the_quick_tests_are_some_of_those_before_a_commit():
    assert chosen_by("test-quick") == [set()]
    assert chosen_by("test") == [set(), {"slow"}]
    assert len(chosen_by("test-long")) == 8
    assert chosen_by("test-times") == [
        marks for marks in chosen_by("test-long") if "long" not in marks
    ]


def marks_of(items):
    return [sorted(item.marks) for item in items]


def test_a_test_is_marked_by_the_time_of_all_its_cases():
    cases = [Collected(f"tests/a/test_b.py::test_c[{n}]", x=n) for n in range(4)]
    for total, expected in (
        (LIMITS["slow"], []),
        (1.01 * LIMITS["slow"], ["slow"]),
        (LIMITS["heavy"], ["slow"]),
        (1.01 * LIMITS["heavy"], ["heavy", "slow"]),
    ):
        for case in cases:
            case.marks.clear()
        mark_by_time(cases, {"a/test_b.py": {"test_c": total / 4}})
        assert marks_of(cases) == [expected] * 4


@pytest.mark.parametrize(("each", "count"), [(0.25, 4), (0.26, 3), (0.9, 1), (1.1, 1)])
def test_some_cases_of_the_longest_tests_are_run_for_every_change(each, count):
    cases = [Collected(f"tests/a.py::test_b[{n}]", x=n) for n in range(4)]
    mark_by_time(cases, {"a.py": {"test_b": each * LONGEST}})
    assert ["long" in case.marks for case in cases] == [n >= count for n in range(4)]


def test_a_test_that_was_not_measured_has_no_mark():
    items = [Collected("tests/a/test_b.py::test_c"), Collected("tests/a/test_b.py::test_d", x=1)]
    mark_by_time(items, {"a/test_b.py": {"test_e": 9.0}, "test_b.py": {"test_c": 9.0}})
    assert marks_of(items) == [[], []]


def test_cases_that_use_each_value_once_are_kept():
    cases = [
        Collected("tests/a.py::test_b[]", variant=variant, engine=engine, rng=seed)
        for variant in ("x", "y")
        for engine in ("p", "q")
        for seed in range(4)
    ]
    mark_by_time(cases, {"a.py": {"test_b": 0.4 * LIMITS["slow"]}})
    kept = [case.callspec.params for case in cases if not case.marks]
    assert [{**params, "rng": 0} for params in kept] == [
        {"variant": "x", "engine": "p", "rng": 0},
        {"variant": "y", "engine": "q", "rng": 0},
    ]
    assert ["heavy", "slow"] in marks_of(cases)


@pytest.mark.parametrize(
    ("shortest_first", "expected"),
    [
        (False, ["b.py::b", "b.py::a", "a.py::b", "a.py::a"]),
        (True, ["a.py::a", "a.py::b", "b.py::a", "b.py::b"]),
    ],
)
def test_files_and_tests_are_ordered_by_their_time(shortest_first, expected):
    """The longest file first, in its own order; or the shortest file with its shortest test."""
    names = ["a.py::b", "a.py::a", "b.py::b", "b.py::a"]
    items = [Collected(f"tests/{name}") for name in names]
    seconds = {"a.py": {"b": 1.0, "a": 0.5}, "b.py": {"b": 2.0, "a": 1.0}}
    order_files(items, seconds, shortest_first)
    assert [item.nodeid.removeprefix("tests/") for item in items] == expected


REPORT = """<testsuites><testsuite>
<testcase classname="tests.support.test_tiers" name="test_x[1]" time="3.0"/>
<testcase classname="tests.support.test_tiers" name="test_x[2-a]" time="1.0"/>
<testcase classname="tests.support.test_tiers.TestY" name="test_z" time="2.5"/>
<testcase classname="tests.support.test_tiers" name="test_fast" time="0.01"/>
</testsuite></testsuites>"""


def test_times_are_taken_from_a_report_of_pytest(tmp_path, monkeypatch):
    (tmp_path / "times.xml").write_text(REPORT)
    old = {"test_fast": 7.0, "test_not_run": 5.0}
    kept = tmp_path / "seconds.json"
    kept.write_text(json.dumps({"support/test_tiers.py": old, "gone.py": {"test_x": 1.0}}))
    monkeypatch.setattr(measure, "SECONDS_FILE", kept)
    monkeypatch.setattr(measure, "read_seconds", lambda: json.loads(kept.read_text()))
    measure.main([str(tmp_path / "times.xml")])
    assert json.loads(kept.read_text()) == {
        "support/test_tiers.py": {"TestY::test_z": 2.5, "test_not_run": 5.0, "test_x": 2.0}
    }
