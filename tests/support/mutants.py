"""Wrong programs: each mutant changes one place of the code, and the tests must notice.

`python -m support.mutants [ROOM ...]` runs tests against a copy of the program with that change,
until one fails, and prints which. It lists the survivors, with exit code 1 if one of them is not
expected.

A room is a file `tests/mutants/ROOM.toml`: the paths of its tests, and its mutants. Each has the
file, the text that is replaced, the new text, and what is wrong then. `first` names the tests that
should notice; all tests of the room run only if these pass. `survives` gives the reason why no test
can notice.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
import tomllib
from concurrent.futures import ThreadPoolExecutor
from itertools import count
from pathlib import Path
from queue import SimpleQueue
from typing import NamedTuple

import click

from support.tiers import SHORTEST_FIRST

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "tests/mutants"
PROGRAM = ("src", "cli", "configs")
"""What a copy of the program needs."""

MARKS = "not heavy and not long and not browser"
FIRST_MARKS = "not long and not browser"
"""Tests that are named by a mutant run also if they are heavy."""

STAMPS = count(int(time.time()) + 10**6)
"""Times of changed files, s: all differ."""

TIME_LIMIT = 300.0
"""s: a mutant whose tests take longer counts as killed; some mutants never end."""


class Mutant(NamedTuple):
    """A wrong program.

    Attributes:
        room: The name of its room.
        tests: The tests of the room.
        file: The file that is changed, relative to the root.
        old: The text that is replaced; it occurs once.
        new: The text in its place.
        what: What is wrong then.
        first: The tests that should notice.
        survives: Why no test can notice; "" if one must.
    """

    room: str
    tests: tuple[str, ...]
    file: str
    old: str
    new: str
    what: str
    first: tuple[str, ...] = ()
    survives: str = ""

    def changed(self, root=ROOT):
        """Return the text of the changed file.

        Raises:
            ValueError: The text that is to be replaced does not occur exactly once.
        """
        text = (root / self.file).read_text(encoding="utf-8")
        if text.count(self.old) != 1:
            raise ValueError(f"{self.file} has {text.count(self.old)} times: {self.old!r}")
        return text.replace(self.old, self.new)


def mutants(rooms=()):
    """Return the mutants of some rooms; of all rooms by default."""
    for path in sorted(FOLDER.glob("*.toml")):
        if not rooms or path.stem in rooms:
            table = tomllib.loads(path.read_text(encoding="utf-8"))
            for entry in table["mutant"]:
                first = tuple(entry.pop("first", ()))
                yield Mutant(path.stem, tuple(table["tests"]), first=first, **entry)


def killer(mutant, tree):
    """Return the test that notices a mutant, "" if none does; `tree` is a copy of the program."""
    file = tree / mutant.file
    original = file.read_text(encoding="utf-8")
    write(file, mutant.changed())
    try:
        failed = first_failure(mutant.first, FIRST_MARKS, tree) if mutant.first else ""
        return failed or first_failure(mutant.tests, MARKS, tree)
    finally:
        write(file, original)


def write(file, text):
    """Write a file with a time of its own: Python tells by time and size if it must compile it."""
    file.write_text(text, encoding="utf-8")
    stamp = next(STAMPS)
    os.utime(file, (stamp, stamp))


def first_failure(tests, marks, tree):
    """Return the first of some tests that fails against a copy of the program; "" if none does.

    Raises:
        RuntimeError: pytest ran no test, or the call is wrong.
    """
    paths = os.pathsep.join(str(tree / part) for part in PROGRAM[:2])
    options = ("-x", "-q", "-p", "no:cacheprovider", SHORTEST_FIRST, "-m", marks)
    try:
        done = subprocess.run(
            [sys.executable, "-m", "pytest", *options, *tests],
            cwd=ROOT,
            env=os.environ | {"PYTHONPATH": paths, "OPENBLAS_NUM_THREADS": "1"},
            capture_output=True,
            text=True,
            timeout=TIME_LIMIT,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return f"no end within {TIME_LIMIT:g} s"
    if done.returncode not in {0, 1, 2}:
        raise RuntimeError(f"pytest ended with {done.returncode}: {tests}")
    names = re.findall(r"^(?:FAILED|ERROR) (.+?)(?: - |$)", done.stdout, re.MULTILINE)
    return next(iter(names), "not imported") if done.returncode else ""


@click.command()
@click.argument("rooms", nargs=-1)
@click.option("--processes", default=2, show_default=True)
def main(rooms, processes):
    """Run the mutants of some ROOMS, or of all, and list the survivors."""
    chosen = list(mutants(rooms))
    trees: SimpleQueue[Path] = SimpleQueue()

    def run(mutant):
        tree, begin = trees.get(), time.perf_counter()
        try:
            failed = killer(mutant, tree)
        finally:
            trees.put(tree)
        word = "killed" if failed else "SURVIVED"
        seconds = time.perf_counter() - begin
        click.echo(f"{word:<9} {seconds:5.0f} s  {mutant.room}: {mutant.file}: {mutant.what}")
        if failed:
            click.echo(f"{'':<19}{failed}")
        return not failed

    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(processes) as pool:
        for number in range(processes):
            tree = Path(folder) / str(number)
            for part in PROGRAM:
                shutil.copytree(ROOT / part, tree / part)
            trees.put(tree)
        alive = [
            survivor for survivor, lives in zip(chosen, pool.map(run, chosen), strict=True) if lives
        ]
    unexpected = [mutant for mutant in alive if not mutant.survives]
    click.echo(f"{len(chosen)} mutants, {len(alive)} survivors, {len(unexpected)} unexpected")
    for mutant in alive:
        click.echo(f"  {mutant.file}: {mutant.what} {mutant.survives and f'({mutant.survives})'}")
    sys.exit(bool(unexpected))


if __name__ == "__main__":
    main()
