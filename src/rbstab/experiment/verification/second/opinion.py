"""Asks codac about the claims of a proof, for the equations of its config."""

import json
import subprocess
import sys
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from rbstab.config.schema import Config
from rbstab.config.user_code.permission import has_code, may_run_code
from rbstab.experiment.proof import CODE_NOT_RUN
from rbstab.experiment.stored_proof.proof import Proof, ProvedState, ProvedStates
from rbstab.experiment.verification.second.recorded import NoOpinionError, Recorded, recorded_energy

SECONDS = 60.0
"""The time of a processor after which codac's solver is not asked again, s."""

LATEST = 300.0
"""The time after which the process is ended, s: the solver itself heeds no limit."""

PROGRAM = Path(__file__).with_name("__main__.py")

ABOUT, UNDECIDED = "codac", "second opinion"
"""What a finding is about, and the claim of one that codac did not decide."""

TOO_LONG = "It took too long."


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


def second_opinion(proof: Proof, config: Config) -> Iterator[tuple[str, str, bool, str]]:
    """Yield what codac says of the claims of a proof about ranges of Θ, for a config.

    Each is what a finding is made of: what it is about, the claim, whether it is verified, and
    sentences. A claim that is not decided has the name `UNDECIDED`, and its own in its sentences.
    """
    from rbstab.proof.check.findings import EVERYWHERE, IN_RANGE  # imported late, as by `verify`
    from rbstab.proof.model import RANGE_END

    try:
        if has_code(config) and not may_run_code(config):
            raise NoOpinionError(CODE_NOT_RUN)
        energy = recorded_energy(config)
    except NoOpinionError as error:
        yield ABOUT, UNDECIDED, False, f"It was not asked: {error}."
        return
    pi, half, _ = RANGE_END.tolist()
    ranges = [_claims(IN_RANGE, proof, (pi, half, pi))]
    if proof.unwrapped is not None and proof.unwrapped.end is not None:
        first, _, third = proof.unwrapped.end
        ranges.append(_claims(EVERYWHERE, proof.unwrapped, (first, half, third)))
    for place, claim, verdict, text in _answers(energy, ranges):
        decided = verdict != "not decided"
        said = text if decided else f"{claim[0].upper()}{claim[1:]}: {text}"
        name = claim if decided else UNDECIDED
        yield f"{ABOUT}: {place}", name, verdict == "proved", said


def not_asked(proof: Proof) -> Iterator[str]:
    """Yield what codac is not asked of a proof, as sentences."""
    wide = proof.unwrapped
    if wide is not None:
        yield "codac: that all rest states with any θ1 and θ3 are in the range that it searches."
    if any(found is not None and found.regions for found in (proof, wide)):
        yield "codac: the region of each minimum beyond the certified region."
    if proof.every_start:
        yield "codac: that barriers or stops keep every motion in the range."


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
    command, ended = [sys.executable, "-P", str(PROGRAM)], TOO_LONG
    process = subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    with process:
        try:
            lines, errors = process.communicate(json.dumps(data), LATEST)
            if process.returncode:
                ended = f"Its process ended with {process.returncode}: {errors.strip()}"
        except subprocess.TimeoutExpired:
            process.kill()
            lines, _ = process.communicate()
    for line in lines.splitlines():
        yield json.loads(line)
    if process.returncode:
        yield ["all claims", "the others", "not decided", ended]
