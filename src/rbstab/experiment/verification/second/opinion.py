"""Asks codac about the claims of a proof, for the equations of its config."""

import json
import math
import subprocess
import sys
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rbstab.config.schema import Config
from rbstab.experiment.stored_proof.proof import Proof, ProvedState, ProvedStates
from rbstab.experiment.verification.second.recorded import NoOpinionError, Recorded, recorded_energy

if TYPE_CHECKING:
    from rbstab.proof.check.findings import Finding

SECONDS = 60.0
"""The time after which claims are not decided."""

GRACE = 30.0
"""Seconds more until the process is ended: the solver may not look at its watch."""

PROGRAM = Path(__file__).with_name("codac_process.py")

UNDECIDED = "second opinion"
"""The claim of a finding that codac did not decide."""


class NoCodacError(Exception):
    """codac is not installed."""


def check_available() -> None:
    """Check that codac is installed; it is not imported.

    Raises:
        NoCodacError: It is not.
    """
    if find_spec("codac") is None:
        raise NoCodacError(
            "a second opinion needs codac, which a plain install lacks. "
            'Run `pip install "rbstab[second]"`'
        )


def second_opinion(proof: Proof, config: Config) -> "Iterator[Finding]":
    """Yield what codac says of the claims of a proof.

    Args:
        proof: The proof.
        config: Its config, whose code of users may run.
    """
    from rbstab.proof.check.findings import EVERYWHERE, IN_RANGE, Finding

    about = "codac"
    if proof.on_rotations is not None or proof.tied_energy is not None:
        yield Finding(about, UNDECIDED, False, "It is not asked about such lists of rest states.")
        return
    try:
        energy = recorded_energy(config)
    except NoOpinionError as error:
        yield Finding(about, UNDECIDED, False, f"It is not asked, as {error}.")
        return
    pi, half = math.nextafter(math.pi, 4), math.nextafter(math.pi / 2, 2)
    ranges = [_claims(IN_RANGE, proof, (pi, half, pi))]
    if proof.unwrapped is not None:
        first, _, third = proof.unwrapped.end
        ranges.append(_claims(EVERYWHERE, proof.unwrapped, (first, half, third)))
    for place, claim, verdict, text in _answers(energy, ranges):
        undecided = verdict == "not decided"
        said = f"{claim[0].upper()}{claim[1:]}: {text}" if undecided else text
        name = UNDECIDED if undecided else claim
        yield Finding(f"{about}, {place}", name, verdict == "proved", said)


def _claims(name: str, states: ProvedStates, end: tuple[float, float, float]) -> dict[str, Any]:
    """Return what is claimed of a range, as plain data."""
    region = states.region
    level = region.energy_bound if region is not None and region.proved else None
    return {
        "name": name,
        "end": [x.hex() for x in end],
        "complete": states.proved,
        "states": [_state(state) for state in states.states if state.proved],
        "level": None if level is None else level.hex(),
        "depth": None if region is None else region.lower_bound.hex(),
    }


def _state(state: ProvedState) -> dict[str, Any]:
    return {
        "enclosure": [[x.hex() for x in corner] for corner in state.enclosure],
        "index": state.index if state.index_proved else None,
        "held": bool(state.held),
    }


def _answers(energy: Recorded, ranges: list[dict[str, Any]]) -> Iterator[list[str]]:
    """Yield range, claim, verdict and text of each claim that codac answers; then what is left."""
    data = {
        "operations": energy.operations,
        "stop": None if energy.stop is None else str(energy.stop),
        "seconds": SECONDS,
        "ranges": ranges,
    }
    # -P: nothing beside the file is imported in place of a package.
    command = [sys.executable, "-P", str(PROGRAM)]
    ended = "It took too long."
    try:
        done = subprocess.run(
            command, input=json.dumps(data), capture_output=True, text=True,
            timeout=SECONDS + GRACE, check=False,
        )
        lines = done.stdout
        if done.returncode:
            last = done.stderr.strip().splitlines()
            ended = f"Its process ended with {done.returncode}: {last[-1] if last else ''}"
    except subprocess.TimeoutExpired as error:
        lines = (error.stdout or b"").decode()
        done = None
    for line in lines.splitlines():
        yield json.loads(line)
    if done is None or done.returncode:
        yield ["all", "the claims that are left", "not decided", ended]
