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


def question(ranges: list[Any], energy: Energy, system: System) -> dict[str, Any]:
    """Return what codac is asked about stored claims, for a traced energy, as plain data.

    At some attitudes the least energy, J, comes from the system: it is quadratic in all but Θ.

    Args:
        ranges: The claims of each range, from the record of a proof.
        energy: The traced energy.
        system: The system of the config.
    """
    U = energy.U if energy.plain is None else energy.plain
    named = [
        claims | {"name": EVERYWHERE if claims.get("everywhere") else IN_RANGE} for claims in ranges
    ]
    at_rest, samples = configurations(system), list[Any]()
    unit, most = np.eye(at_rest.size), 0.95 * float(energy.stop or RANGE_END[1])
    for Theta in np.random.default_rng(0).uniform(-1, 1, (16, 3)) * [3, most, 3]:
        q = Theta @ unit[:3]
        b = at_rest.gradient(q)[3:]
        H = np.array([at_rest.gradient(q + e)[3:] - b for e in unit[3:]]).reshape(len(b), len(b))
        samples.append([Theta.tolist(), float(at_rest.energy(q) - 0.5 * b @ np.linalg.solve(H, b))])
    slopes = [operations_of(derivative(U, {k: expr(1)})) for k in range(3)]
    asked = {"energy": operations_of(U), "slopes": slopes, "stop": bool(energy.stop)}
    return asked | {"ranges": named, "samples": samples}


def answers(data: dict[str, Any]) -> Iterator[list[str]]:
    """Yield range, claim, verdict and text of each claim that codac answers; then what is left."""
    # -P: nothing beside the file is imported in place of a package.
    command = [sys.executable, "-uP", str(Path(__file__).with_name("__main__.py"))]
    pipes: dict[str, Any] = {"input": json.dumps(data), "capture_output": True, "text": True}
    try:
        done = subprocess.run(command, timeout=LATEST, check=False, **pipes)
        text = f"Its process ended with {done.returncode}: {done.stderr.strip()}"
        lines, ended = done.stdout, text if done.returncode else None
    except subprocess.TimeoutExpired as late:
        lines, ended = (late.stdout or b"").decode(), "It took too long."
    yield from map(json.loads, lines.splitlines())
    if ended:
        yield ["all claims", "the others", "not decided", ended]
