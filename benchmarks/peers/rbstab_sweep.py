"""Row of `rbstab sweep`: all members are computed in batches and stored. It needs this project.

The comparison of sampled members with SciPy, at the end of a sweep, is left out.
"""

import sys
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

if __name__ == "__main__":
    from serve import pin_to_core

    pin_to_core()

import numpy as np

from benchmarks.swept import Sweeping, plan_of, warm_engine

STATES = ("orientation", "angular_velocity", "position", "velocity")


def peer(keep: str, problem: Mapping[str, Any]) -> Callable[[float, int], Callable[[bool], Any]]:
    """Return the function that compiles a sweep with a tolerance."""
    samples = len(problem["times"])

    def prepare(tolerance: float, members: int) -> Callable[[bool], Any]:
        settings = ("integration.engine=heyoka", f"integration.rtol={tolerance!r}")
        sweeping = Sweeping(plan_of(members, samples, keep, settings), 1)

        def sweep(states_wanted: bool) -> Any:
            if states_wanted:
                return motions_of(members, samples, settings)
            sweeping.seconds()
            return None

        return sweep

    return prepare


def motions_of(members: int, samples: int, settings: tuple[str, ...]) -> Any:
    """Return the states [Θ, Ω, X, V] that a sweep stores, shape (members, samples, 12)."""
    plan = plan_of(members, samples, "traces", settings)
    traces = warm_engine(plan).compute(0, members).traces
    assert traces is not None
    return np.concatenate([traces[name] for name in STATES], axis=2)


if __name__ == "__main__":
    from serve import serve

    serve(partial(peer, sys.argv[1]), ("heyoka",))
