"""Asks codac about the claims of a proof, for the equations of its config."""

import json
import subprocess
import sys
from collections.abc import Iterator
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from rbstab.analysis.configuration import configurations
from rbstab.analysis.rest_system import smooth_rest_system
from rbstab.config.build import problem_of, system_of
from rbstab.config.schema import Config
from rbstab.config.user_code.permission import may_build, without_code
from rbstab.experiment.proof import CODE_NOT_RUN
from rbstab.experiment.stored_proof.proof import Proof
from rbstab.mechanics.numbers import Array
from rbstab.systems.system import System

LATEST = 300.0
"""The time after which the process is ended, s."""

PROGRAM = Path(__file__).with_name("__main__.py")

ABOUT, UNDECIDED = "codac", "second opinion"
"""What a finding is about, and the claim of one that codac did not decide."""

TOO_LONG = "It took too long."

FUNCTIONS = frozenset({"var", "sum", "times", "pow", "sin", "cos", "exp", "sqrt"})
"""The operations of an energy that codac is asked about."""

SAMPLES = 16
"""Attitudes at which U is compared with the stored energy in doubles."""


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
    data = question(proof, config)
    if isinstance(data, str):
        yield ABOUT, UNDECIDED, False, f"It was not asked: {data}."
        return
    for place, claim, verdict, text in answers(data):
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


def question(proof: Proof, config: Config) -> dict[str, Any] | str:
    """Return what codac is asked, as plain data; the reason if it is not.

    The claims are those of the proof, the energy is that of the config, traced anew. At some
    attitudes its value comes from the equations in doubles, without elimination.
    """
    from rbstab.proof.check.findings import EVERYWHERE, IN_RANGE  # imported late, as by `verify`
    from rbstab.proof.model import RANGE_END
    from rbstab.proof.reasons import NoReducedEnergy
    from rbstab.proof.record import energy_record
    from rbstab.proof.rest_states import reduced_energy

    if not may_build(config):
        return CODE_NOT_RUN
    system = smooth_rest_system(problem_of(config))
    try:
        energy = reduced_energy(system, partial(system_of, without_code(config)))
    except NoReducedEnergy as error:
        return str(error)
    record = energy_record(energy)
    if energy.free:
        return "X, or own states, are left in its energy"
    if not FUNCTIONS.issuperset(one[0] for one in record["operations"]):
        return "its energy has terms that switch, or rare functions"
    ends = {"pi": RANGE_END[0], "pi/2": RANGE_END[1]}
    ranges = [
        {**claims, "end": [ends.get(end, end) for end in claims["end"]]}
        | {"name": EVERYWHERE if claims.get("everywhere") else IN_RANGE}
        for claims in proof.record["ranges"]
    ]
    most = float(energy.stop or RANGE_END[1])
    samples = np.random.default_rng(0).uniform(-1.0, 1.0, (SAMPLES, 3)) * [3.0, 0.95 * most, 3.0]
    values = [[Theta.tolist(), least_energy(system, Theta)] for Theta in samples]
    found: dict[str, Any] = _hexadecimal({"energy": record, "ranges": ranges, "samples": values})
    return found


def least_energy(system: System, Theta: Array) -> float:
    """Return the least stored energy at given angles, J: in all else it is quadratic."""
    at_rest = configurations(system)
    q = np.concatenate([Theta, np.zeros(at_rest.size - 3)])
    b = at_rest.gradient(q)[3:]
    H = np.array([at_rest.gradient(q + e)[3:] - b for e in np.eye(at_rest.size)[3:]])
    z = np.linalg.solve(H.reshape(len(b), len(b)), b)
    return float(at_rest.energy(q) - 0.5 * b @ z)


def _hexadecimal(data: Any) -> Any:
    """Return plain data with each double in hexadecimal."""
    if isinstance(data, dict):
        return {key: _hexadecimal(value) for key, value in data.items()}
    if isinstance(data, list):
        return [_hexadecimal(value) for value in data]
    return float(data).hex() if isinstance(data, float) else data


def answers(data: dict[str, Any]) -> Iterator[list[str]]:
    """Yield range, claim, verdict and text of each claim that codac answers; then what is left."""
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
