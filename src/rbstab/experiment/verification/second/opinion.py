"""Asks codac about the claims of a proof, for the equations of its config."""

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from rbstab.analysis.configuration import configurations
from rbstab.proof.check.findings import EVERYWHERE, IN_RANGE
from rbstab.proof.exact.expr import expr
from rbstab.proof.exact.rewriting import derivative
from rbstab.proof.model import RANGE_END, Energy
from rbstab.proof.record import operations_of
from rbstab.systems.system import System

LATEST = 300.0  # s: then the process is ended
PROGRAM = Path(__file__).with_name("__main__.py")


def question(ranges: list[Any], energy: Energy, system: System) -> dict[str, Any]:
    """Return what codac is asked about stored claims, for a traced energy, as plain data.

    The energy at some attitudes comes from the system, in doubles.
    """
    U = energy.U if energy.plain is None else energy.plain
    stop, ends = energy.stop, {"pi": RANGE_END[0], "pi/2": RANGE_END[1]}
    named = [
        {**claims, "end": [ends.get(end, end) for end in claims["end"]]}
        | {"name": EVERYWHERE if claims.get("everywhere") else IN_RANGE}
        for claims in ranges
    ]
    at_rest, samples = configurations(system), list[Any]()
    unit, most = np.eye(at_rest.size), 0.95 * float(stop or RANGE_END[1])
    for Theta in np.random.default_rng(0).uniform(-1, 1, (16, 3)) * [3, most, 3]:
        # The least stored energy, J: in all but Θ it is quadratic, without elimination.
        q = Theta @ unit[:3]
        b = at_rest.gradient(q)[3:]
        H = np.array([at_rest.gradient(q + e)[3:] - b for e in unit[3:]]).reshape(len(b), len(b))
        samples.append([Theta.tolist(), float(at_rest.energy(q) - 0.5 * b @ np.linalg.solve(H, b))])
    slopes = [operations_of(derivative(U, {k: expr(1)})) for k in range(3)]
    found = {"energy": operations_of(U), "slopes": slopes, "stop": bool(stop)}
    return found | {"ranges": named, "samples": samples}


def answers(data: dict[str, Any]) -> Iterator[list[str]]:
    """Yield range, claim, verdict and text of each claim that codac answers; then what is left."""
    # -P: nothing beside the file is imported in place of a package.
    command, pipe = [sys.executable, "-uP", str(PROGRAM)], subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe, text=True) as process:
        try:
            lines, errors = process.communicate(json.dumps(data), LATEST)
            ended = f"Its process ended with {process.returncode}: {errors.strip()}"
        except subprocess.TimeoutExpired:
            process.kill()
            (lines, _), ended = process.communicate(), "It took too long."
    yield from map(json.loads, lines.splitlines())
    if process.returncode:
        yield ["all claims", "the others", "not decided", ended]
