"""Protects the second opinion: codac confirms shipped proofs, refutes wrong claims, and says where
it does not decide. codac runs in a process of its own: here it would change all rounding.
"""

import subprocess
import sys
from collections.abc import Sequence
from math import prod
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rbstab.analysis.configuration import configurations
from rbstab.config.build import system_of
from rbstab.config.load import load_config
from rbstab.config.schema import Config
from rbstab.experiment.proof import prove
from rbstab.experiment.stored_proof.proof import Proof
from rbstab.experiment.verification.second import opinion
from rbstab.experiment.verification.second.opinion import UNDECIDED, second_opinion
from rbstab.experiment.verification.second.recorded import NoOpinionError, recorded_energy
from rbstab.experiment.verification.verify import verify

CONFIGS = Path(__file__).parents[3] / "configs"

QUICK = ("examples/real_body", "examples/stability/fast", "examples/stability/fast_guarded")

HEAVY = (
    "examples/elements_proved",
    "examples/free_gravity",
    "examples/full_gains",
    "examples/magnet",
    "examples/permanent_gravity_equilibrium",
    "examples/permanent_gravity_origin",
    "examples/stop",
    "paper/case1_guarded",
    "paper/case1_permanent",
    "paper/case2_guarded",
    "paper/case2_stiff",
    "paper/case2_visco_elastic",
    "paper/case3_embedded",
    "paper/case3_guarded",
)
"""The other shipped configs whose claims codac decides, one of each energy."""

UNDECIDED_CONFIGS = {
    "examples/counterweight": "may jump",
    "examples/ligament_proved": "not quadratic in X",
    "examples/cubic_spring": "not quadratic in X",
}


def config_of(name: str) -> Config:
    return load_config(CONFIGS / f"{name}.yaml", allow_python=True)


def asked(proof: Proof, config: Config) -> dict[tuple[str, str], bool]:
    return {(about, claim): fine for about, claim, fine, _ in second_opinion(proof, config)}


def confirm(name: str) -> None:
    config = config_of(name)
    proof = prove(config)
    assert proof.proved
    found = asked(proof, config)
    assert all(found.values()), found
    for states, place in ((proof, "the range of eq. 5"), (proof.unwrapped, "all θ1 and θ3")):
        claims = [claim for about, claim in found if about == f"codac: {place}"]
        if states is None:
            assert not claims
        else:
            listed = [f"rest state {k + 1}" for k in range(len(states.states))]
            region = ["certified region"] * (states.region is not None)
            assert claims == [*listed, "no other rest state", *region]


@pytest.mark.slow
@pytest.mark.parametrize("name", QUICK)
def test_a_shipped_proof_is_confirmed(name: str) -> None:
    confirm(name)


@pytest.mark.heavy
@pytest.mark.parametrize("name", HEAVY)
def test_all_shipped_proofs_that_it_can_decide_are_confirmed(name: str) -> None:
    confirm(name)


@pytest.fixture(scope="module")
def config() -> Config:
    return config_of("examples/stability/fast")


@pytest.fixture(scope="module")
def proof(config: Config) -> Proof:
    """Return the only rest state in the range of eq. 5, with its region."""
    return prove(config).model_copy(update={"unwrapped": None})


def changed(proof: Proof, **entries: Any) -> Proof:
    return Proof.model_validate({**proof.model_dump(mode="json"), **entries})


def refuted(proof: Proof, config: Config) -> list[str]:
    return [
        claim
        for _, claim, fine, _ in second_opinion(proof, config)
        if not fine and claim != UNDECIDED
    ]


@pytest.mark.slow
def test_a_proof_is_confirmed_and_one_without_a_state_is_refuted(
    proof: Proof, config: Config
) -> None:
    assert all(asked(proof, config).values())
    without = changed(proof, states=[], unique=False, closed=None, region=None, regions=[])
    assert refuted(without, config) == ["no other rest state"]


@pytest.mark.slow
@pytest.mark.parametrize("axis", range(3))
def test_an_enclosure_that_is_moved_is_refuted(proof: Proof, config: Config, axis: int) -> None:
    for far in (1e-6, 0.02):
        data = proof.model_dump(mode="json")
        for corner in data["states"][0]["enclosure"]:
            corner[axis] += far
        assert "rest state 1" in refuted(changed(proof, **data), config)


@pytest.mark.slow
def test_a_box_with_its_zero_on_the_border_is_not_confirmed(proof: Proof, config: Config) -> None:
    data = proof.model_dump(mode="json")
    low, high = data["states"][0]["enclosure"]
    low[0], high[0] = 0.0, high[0] - low[0]
    found = asked(changed(proof, **data), config)
    assert found["codac: the range of eq. 5", UNDECIDED] is False
    assert ("codac: the range of eq. 5", "rest state 1") not in found


@pytest.mark.slow
def test_wrong_claims_are_refuted(proof: Proof, config: Config) -> None:
    data = proof.model_dump(mode="json")
    data["states"][0]["index"] = 1
    data["region"]["energy_bound"] += 1e-4 * data["region"]["lower_bound"]
    assert refuted(changed(proof, **data), config) == ["rest state 1", "certified region"]
    data = proof.model_dump(mode="json")
    data["region"]["lower_bound"] *= 1 + 1e-6
    assert refuted(changed(proof, **data), config) == ["certified region"]


@pytest.mark.slow
def test_the_equations_are_those_of_the_config(proof: Proof, config: Config) -> None:
    """The stored energy has no effect: codac is asked about that of the config."""
    softer = load_config(config, ["controller.K_r[1]=399"], allow_python=True)
    assert refuted(proof, softer) == ["certified region"]


def test_what_takes_too_long_is_not_decided(
    proof: Proof, config: Config, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(opinion, "SECONDS", 0.0)
    monkeypatch.setattr(opinion, "LATEST", 0.01)
    assert list(second_opinion(proof, config)) == [
        ("codac: all claims", UNDECIDED, False, "The others: It took too long.")
    ]
    # Without time for the solver, what needs no search is decided all the same.
    monkeypatch.setattr(opinion, "LATEST", 300.0)
    found = list(second_opinion(proof, config))
    assert [claim for _, claim, fine, _ in found if fine] == ["rest state 1"]
    assert {claim for _, claim, fine, _ in found if not fine} == {UNDECIDED}
    verified = verify(proof, config, second=True)
    assert verified.takes_too_long
    assert verified.outcome == "not decided: codac does not decide every claim"


@pytest.mark.parametrize(("name", "why"), UNDECIDED_CONFIGS.items(), ids=list(UNDECIDED_CONFIGS))
def test_what_codac_is_not_asked_has_its_reason(proof: Proof, name: str, why: str) -> None:
    ((about, claim, fine, text),) = second_opinion(proof, config_of(name))
    assert (about, claim, fine) == ("codac", UNDECIDED, False)
    assert why in text


def test_code_that_may_not_run_is_not_asked_about(
    proof: Proof, monkeypatch: pytest.MonkeyPatch
) -> None:
    config = config_of("examples/magnet")
    monkeypatch.setattr(opinion, "may_run_code", lambda _: False)
    ((_, claim, _, text),) = second_opinion(proof, config)
    assert claim == UNDECIDED
    assert "--allow-python" in text


def test_codac_is_not_imported_here() -> None:
    """It would round the whole process upward."""
    code = "import sys, rbstab.experiment.verification.verify; print('codac' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"


def value(operations: Sequence[Sequence[Any]], Theta: Sequence[float]) -> float:
    """Return the last of some operations in doubles."""
    found: list[float] = []
    for kind, *rest in operations:
        if kind == "var":
            found.append(Theta[rest[0]])
        elif kind == "sum":
            pairs = zip(rest[1::2], rest[2::2], strict=True)
            found.append(number(rest[0]) + sum(number(c) * found[k] for c, k in pairs))
        elif kind == "times":
            found.append(prod(found[k] for k in rest))
        elif kind == "pow":
            found.append(found[rest[1]] ** rest[0])
        elif kind == "step":
            found.append(float(found[rest[0]] > 0))
        else:
            found.append(float(getattr(np, {"atan": "arctan"}.get(kind, kind))(found[rest[0]])))
    return found[-1]


def number(text: str) -> float:
    top, _, bottom = text.partition("/")
    return int(top) / int(bottom or 1)


def least_energy(config: Config, Theta: Sequence[float]) -> float:
    """Return the least stored energy at given angles, which is quadratic in all else."""
    at_rest = configurations(system_of(config))
    q = np.array([*Theta, *[0.0] * (at_rest.size - 3)])
    basis = np.eye(at_rest.size)[3:]
    b = at_rest.gradient(q)[3:]
    H = np.array([at_rest.gradient(q + e)[3:] - b for e in basis]).reshape(len(b), len(b))
    return float(at_rest.energy(q) - 0.5 * b @ np.linalg.solve(H, b))


def recorded() -> list[str]:
    paths = sorted([*CONFIGS.glob("paper/*.yaml"), *CONFIGS.glob("examples/**/*.yaml")])
    names = [str(path.relative_to(CONFIGS).with_suffix("")) for path in paths]
    return [name for name in names if "sliding" not in name and "driven" not in name]


@pytest.mark.parametrize("name", recorded())
def test_the_recorded_energy_is_the_least_stored_energy(name: str) -> None:
    config = config_of(name)
    try:
        energy = recorded_energy(config)
    except NoOpinionError:
        assert name not in QUICK + HEAVY
        return
    for k in range(5):
        Theta = (0.7 * k - 1.3, 0.41 * k - 0.85, 1.1 - 0.6 * k)
        if energy.stop is None or abs(Theta[1]) < energy.stop:
            assert value(energy.operations, Theta) == pytest.approx(
                least_energy(config, Theta), rel=1e-9, abs=1e-9
            )
