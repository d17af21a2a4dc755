"""The loop of a peer's process: it reads requests from the driver and answers them.

It runs in the environment of the peer, so it needs only the standard library and numpy. A request
and an answer are one line of JSON each. The first request is the problem.
"""

import json
import os
import sys
import time
import traceback
from collections.abc import Callable, Mapping
from importlib.metadata import version
from typing import Any, TextIO

Problem = Mapping[str, Any]
"""`mass`, `inertia`, `contact_point`, the gains, `times` in s, `starts` of all members."""

Integrate = Callable[[bool], Any]
"""Integrates the members; this is what is timed. Its argument: whether the caller reads the states.

It returns the states [Θ, Ω, X, V] at the samples, shape (members, samples, 12).
"""

Prepare = Callable[[float, int], Integrate]
"""Prepares a setting (a tolerance, or a number of steps) and a number of members; not timed."""


def pin_to_core() -> None:
    """Keep this process and its threads on one core. Call it before importing the peer."""
    os.environ["XLA_FLAGS"] = "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"
    for name in ("OMP", "OPENBLAS", "MKL", "NUMBA"):
        os.environ[f"{name}_NUM_THREADS"] = "1"
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})


def serve(peer: Callable[[Problem], Prepare], packages: tuple[str, ...]) -> None:
    """Answer the driver's requests until it closes the pipe.

    Args:
        peer: Builds and compiles what all settings share.
        packages: The packages whose versions are reported.
    """
    answers = _driver_pipe()
    prepare = peer(json.loads(sys.stdin.readline()))
    _answer(answers, {"versions": [f"{name} {version(name)}" for name in packages]})
    prepared: dict[tuple[float, int], Integrate] = {}
    for line in sys.stdin:
        request = json.loads(line)
        key = (request["setting"], request["members"])
        try:
            if key not in prepared:
                prepared[key] = prepare(*key)
            _answer(answers, _times(prepared[key], request["states"]))
        except Exception as error:
            traceback.print_exc()
            _answer(answers, {"error": f"{type(error).__name__}: {error}"})


def _times(integrate: Integrate, states_file: str | None) -> dict[str, float]:
    """Integrate the members, and return the wall time and the processor time, s."""
    wall, processor = time.perf_counter(), time.process_time()
    states = integrate(states_file is not None)
    wall, processor = time.perf_counter() - wall, time.process_time() - processor
    if states_file is not None:
        # Not at the top of the file: the core must be chosen before numpy starts its threads.
        import numpy as np

        np.save(states_file, states)
    return {"wall": wall, "processor": processor}


def _driver_pipe() -> TextIO:
    """Return the driver's pipe; what a library prints goes to standard error instead."""
    pipe = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    return pipe


def _answer(pipe: TextIO, answer: dict[str, Any]) -> None:
    pipe.write(json.dumps(answer) + "\n")
    pipe.flush()
