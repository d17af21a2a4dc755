"""Which tests run when, by the time they took when they were last measured.

`tests/data/seconds.json` has the mean time of a case of each test, where it matters; `make
test-times` writes it. A test whose cases together take longer than a limit gets a marker: `slow` or
`heavy`. Where a few of its cases use each value of each parameter and are below the limit, they run
without the marker. A test that takes longer still keeps some cases, at least one; the others get
the marker `long`.
"""

import json
from collections import defaultdict
from collections.abc import Hashable
from pathlib import Path

import pytest

SECONDS_FILE = Path(__file__).parents[1] / "data" / "seconds.json"

LIMITS = {"slow": 0.3, "heavy": 1.25}
"""s: by marker, the longest time of all cases of a test without it."""

LONGEST = 5.0
"""s: the longest time of the cases of a test that are not `long`, unless one case takes longer."""

SHORTEST_FIRST = "--shortest-first"
"""The option with which the tests that take the shortest time come first."""

SEEDS = ("rng", "seed")
"""Parameters of which any value will do."""

Case = set[tuple[str, Hashable]]
"""The values of the parameters of a case, with the names of the parameters."""

Seconds = dict[str, dict[str, float]]
"""By file and by test: the mean time of a case, s."""


def read_seconds():
    """Return the measured times."""
    seconds: Seconds = json.loads(SECONDS_FILE.read_text(encoding="utf-8"))
    return seconds


def names_of(node_id):
    """Return the file of a test, relative to the folder of all tests, and the name without case."""
    file, _, name = node_id.partition("[")[0].partition("::")
    return file.removeprefix("tests/"), name


def mark_by_time(items, seconds):
    """Mark the tests that take long."""
    tests = defaultdict(list)
    for item in items:
        tests[names_of(item.nodeid)].append(item)
    for (file, name), group in tests.items():
        each = seconds.get(file, {}).get(name, 0.0)
        for marker, limit in LIMITS.items():
            kept = below(limit, each, [values_of(item) for item in group])
            for number, item in enumerate(group):
                if number not in kept:
                    item.add_marker(getattr(pytest.mark, marker))
        for item in group[within(LONGEST, each, len(group)) :]:
            item.add_marker(pytest.mark.long)


def within(limit, each, count):
    """Return how many of some cases run within a limit, at least one."""
    return count if each * count <= limit else max(1, int(limit / each))


def values_of(item):
    """Return the values of the parameters of a case, without seeds."""
    given = item.callspec.params if hasattr(item, "callspec") else {}
    return {(key, identity(value)) for key, value in given.items() if key not in SEEDS}


def identity(value):
    """Return what equal values of a parameter have in common; an object is equal to itself only."""
    plain = isinstance(value, (str, int, float, bytes, type(None)))
    return repr(value) if plain else id(value)


def below(limit, each, cases):
    """Return the numbers of the cases that run within a limit: all, a few of them, or none."""
    if each * len(cases) <= limit:
        return set(range(len(cases)))
    kept = covering(cases)
    return kept if each * len(kept) <= limit else set()


def covering(cases):
    """Return the numbers of a few cases that use each value of each parameter.

    Each case that is taken uses the most values that are not used yet. So the values of different
    parameters are combined in different ways.
    """
    missing = set().union(*cases)
    kept = set() if missing else {0}
    while missing:
        best = max(range(len(cases)), key=lambda k: (len(missing & cases[k]), -k))
        kept.add(best)
        missing -= cases[best]
    return kept


def order_files(items, seconds, shortest_first=False):
    """Order the files by the time that their selected tests take, the longest first by default.

    The processes of pytest-xdist take the files one after the other. A long file at the end would
    leave the other processes idle. A search for one test that fails begins with the shortest.
    """
    total: dict[str, float] = defaultdict(float)
    for item in items:
        file, name = names_of(item.nodeid)
        total[file] += seconds.get(file, {}).get(name, 0.0)

    def time(item):
        file, name = names_of(item.nodeid)
        return total[file], seconds.get(file, {}).get(name, 0.0) if shortest_first else 0.0

    items.sort(key=time, reverse=not shortest_first)
