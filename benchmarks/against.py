"""This state beside another commit, run in turns: `make bench BEFORE=COMMIT`."""

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import count
from pathlib import Path
from typing import NamedTuple

from benchmarks.commands import KEYS
from benchmarks.measure import by_turns, line, python, seconds_of
from benchmarks.swept import CASE

ROUNDS = 7
ROOT = Path(__file__).parents[1]
NUMBERS = count()
"""The numbers of the results."""

KERNEL = """
import time
from rbstab import load_config
from rbstab.config.build import problem_of
from rbstab.integrate.engines import engine
problem, run = problem_of(load_config({case!r})), engine({engine!r})
run(problem)
taken = []
for _ in range({times}):
    begin = time.perf_counter()
    run(problem)
    taken.append(time.perf_counter() - begin)
print(sorted(taken)[len(taken) // 2])
"""


def main(commit: str) -> None:
    """Print the ratios of the medians of alternated runs; above 1 this state is slower."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        git = ["git", "-C", str(ROOT), "worktree"]
        subprocess.run([*git, "add", "--quiet", "--detach", folder / "before", commit], check=True)
        states = [State("before", folder / "before", folder), State("after", ROOT, folder)]
        try:
            for what, words in _commands(folder).items():
                _print(what, "1.05", *by_turns(ROUNDS, *(state.command(words) for state in states)))
            for engine, times in (("scipy", 9), ("heyoka", 200)):
                code = KERNEL.format(case=str(Path(CASE).resolve()), engine=engine, times=times)
                taken = by_turns(ROUNDS, *(state.kernel(code) for state in states))
                _print(f"one run by {engine}, in one process", "1.15", *taken)
        finally:
            subprocess.run([*git, "remove", "--force", folder / "before"], check=True)


class State(NamedTuple):
    """A state of the program.

    Args:
        name: Its name.
        root: The folder of its sources.
        folder: Where its results go.
    """

    name: str
    root: Path
    folder: Path

    def command(self, words: list[str]) -> Callable[[], float]:
        """Return what runs a command, and returns its wall time, s.

        Args:
            words: Its words; `OUT` is a new folder, and `LAST` the last such folder.
        """
        last = self.folder / f"{self.name}-last"

        def seconds() -> float:
            out = self.folder / f"{self.name}-{next(NUMBERS)}"
            names = {"OUT": str(out), "LAST": str(last)}
            command = [sys.executable, "-m", "rbstab_cli", *(names.get(w, w) for w in words)]
            with self._sources():
                taken = seconds_of(command)
            if out.is_dir():
                last.unlink(missing_ok=True)
                last.symlink_to(out)
            return taken

        return seconds

    def kernel(self, code: str) -> Callable[[], float]:
        """Return what runs code in a process of its own, and returns the number it prints."""

        def seconds() -> float:
            with self._sources():
                return float(subprocess.check_output(python(code), stderr=subprocess.DEVNULL))

        return seconds

    @contextmanager
    def _sources(self) -> Iterator[None]:
        os.environ["PYTHONPATH"] = os.pathsep.join([str(self.root / "src"), str(self.root / "cli")])
        yield
        del os.environ["PYTHONPATH"]


def _print(name: str, limit: str, before: float, after: float) -> None:
    line(f"{name}: before", before, "s", "")
    line("  after", after, "s", "")
    line("  ratio", after / before, "", f"at most {limit}")


def _commands(folder: Path) -> dict[str, list[str]]:
    plans = {members: folder / f"{members}.yaml" for members in (1_000, 40_000)}
    case = str(Path(CASE).resolve())
    for members, path in plans.items():
        vary = {key: {"uniform": [-40, 40]} for key in KEYS}
        plan = {"base": case, "vary": vary, "design": "random", "seed": 1}
        path.write_text(json.dumps(plan | {"members": members}))
    return {
        "--help": ["--help"],
        "run --no-prove": ["run", "--no-prove", case, "-o", "OUT"],
        "run": ["run", case, "-o", "OUT"],
        "stability": ["stability", case, "-o", "OUT"],
        "sweep of 1,000": ["sweep", "--no-prove", str(plans[1_000]), "-o", "OUT", "-q"],
        "sweep of 40,000": ["sweep", "--no-prove", str(plans[40_000]), "-o", "OUT", "-q"],
        "list": ["list", "LAST"],
        "report --format text": ["report", "LAST", "--format", "text"],
    }
