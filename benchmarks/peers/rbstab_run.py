"""Row of `rbstab run`: each member is a run with its own result file. It needs this project."""

import sys
import tempfile
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

if __name__ == "__main__":
    from serve import pin_to_core

    pin_to_core()

import numpy as np

from benchmarks.swept import plan_of
from rbstab.experiment.run_to_file import run_to_file

STATES = ("orientation", "angular_velocity", "position", "velocity")


def peer(engine: str, problem: Mapping[str, Any]) -> Callable[[float, int], Callable[[bool], Any]]:
    """Return the function that prepares runs of an engine with a tolerance."""
    samples = len(problem["times"])

    def prepare(tolerance: float, members: int) -> Callable[[bool], Any]:
        keys = {"engine": engine, "rtol": tolerance, "atol": tolerance}
        settings = [f"integration.{key}={value!r}" for key, value in keys.items()]
        plan = plan_of(len(problem["starts"]), samples, integration=settings)

        def runs(count: int) -> Any:
            with tempfile.TemporaryDirectory(dir="results") as folder:
                results = [
                    run_to_file(plan.config_of(member), Path(folder) / f"{member}.h5").result
                    for member in range(count)
                ]
            return np.array([np.hstack([result[name] for name in STATES]) for result in results])

        # The first run compiles.
        runs(1)
        return lambda _: runs(members)

    return prepare


if __name__ == "__main__":
    from serve import serve

    serve(partial(peer, sys.argv[1]), ("heyoka", "scipy"))
