"""Writes the times of tests into the file by which `support.tiers` marks them.

Run as a script with the JUnit files of pytest, it replaces the times of the tests that ran.
"""

import json
import sys
from collections import defaultdict
from pathlib import Path
from xml.etree import ElementTree

from support.tiers import SECONDS_FILE, Seconds, read_seconds

TESTS = Path(__file__).parents[1]

LEAST = 0.25
"""s: times of all cases of a test below this one are not kept."""


def measured(report):
    """Return the mean time of the cases of each test in a JUnit file of pytest."""
    times: dict[tuple[str, str], list[float]] = defaultdict(list)
    for case in ElementTree.parse(report).iter("testcase"):  # noqa: S314 (pytest wrote it)
        file, outer = _file_of(case.attrib["classname"])
        name = "::".join([*outer, case.attrib["name"].partition("[")[0]])
        times[file, name].append(float(case.attrib["time"]))
    means: Seconds = defaultdict(dict)
    for (file, name), seconds in sorted(times.items()):
        mean = sum(seconds) / len(seconds)
        means[file][name] = round(mean, 3) if sum(seconds) >= LEAST else 0.0
    return means


def _file_of(dotted):
    """Return the file of a dotted name of a module and classes, and the classes."""
    parts = dotted.split(".")
    if parts[0] == TESTS.name:
        parts = parts[1:]
    for count in range(len(parts), 0, -1):
        file = "/".join(parts[:count]) + ".py"
        if (TESTS / file).exists():
            return file, parts[count:]
    raise FileNotFoundError(dotted)


def _kept(seconds):
    """Yield the times that matter, of files that exist."""
    for file, tests in sorted(seconds.items()):
        kept = {name: time for name, time in sorted(tests.items()) if time}
        if kept and (TESTS / file).exists():
            yield file, kept


def main(reports):
    """Replace the times of the tests in the reports."""
    seconds = read_seconds() if SECONDS_FILE.exists() else {}
    for report in reports:
        for file, tests in measured(Path(report)).items():
            seconds.setdefault(file, {}).update(tests)
    text = json.dumps(dict(_kept(seconds)), indent=1)
    SECONDS_FILE.write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
