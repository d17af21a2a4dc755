"""The process that disturbs commands, as tests see it."""

import json
import os
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from faults.library.control import build

TESTS = Path(__file__).parents[2]


class Harness:
    """A running process of `trials.py`."""

    def __init__(self, process: "subprocess.Popen[str]") -> None:
        self._process = process

    def series(
        self,
        case: str,
        operation: str,
        error: str = "EIO",
        *,
        lasting: bool = False,
        sample: int | None = None,
    ) -> list[dict[str, Any]]:
        """Disturb a command at each call of an operation, and return the trials."""
        request = {
            "case": case,
            "operation": operation,
            "error": error,
            "lasting": lasting,
            "sample": sample,
        }
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(json.dumps(request) + "\n")
        self._process.stdin.flush()
        line = self._process.stdout.readline()
        assert line, "the process of the trials has ended"
        trials: list[dict[str, Any]] = json.loads(line)
        return trials


@contextmanager
def running(folder):
    """Build the library, start the process, and end it with the block."""
    work = folder / "work"
    work.mkdir()
    # The same program as here: the installed one may be another.
    path = os.pathsep.join([str(TESTS), *sys.path])
    variables = {**build(folder), "PYTHONPATH": path, "OPENBLAS_NUM_THREADS": "1"}
    process = subprocess.Popen(
        [sys.executable, "-m", "faults.library.trials", str(work)],
        env=os.environ | variables,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    with process:
        try:
            yield Harness(process)
        finally:
            assert process.stdin is not None
            process.stdin.close()


MAX_SHOWN = 12
"""The largest number of trials that a failed test shows."""


def problems_of(trials):
    """Return the problems of trials as a text, empty if there are none."""
    bad = [trial for trial in trials if trial["problems"]]
    shown = [
        f"{trial['case']}, {trial['fault']} ({trial['first']}): exit code {trial['code']}\n"
        + "".join(f"  - {problem[:500]}\n" for problem in trial["problems"])
        + f"  stderr: {trial['stderr'][-300:]!r}"
        for trial in bad[:MAX_SHOWN]
    ]
    more = len(bad) - len(shown)
    return "\n".join(shown + ([f"and {more} more of {len(trials)} trials"] if more else []))
