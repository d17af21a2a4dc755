"""Protects the second opinion: codac confirms shipped proofs, refutes wrong claims, and says where
it does not decide. codac runs in a process of its own: here it would change all rounding.
"""

import subprocess
import sys
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

from rbstab.config.load import load_config
from rbstab.experiment.proof import prove
from rbstab.experiment.stored_proof.proof import Proof
from rbstab.experiment.verification.second import opinion
from rbstab.experiment.verification.verify import UNDECIDED, second_opinion, verify

CONFIGS = Path(__file__).parents[3] / "configs"

QUICK = ("examples/real_body", "examples/stability/fast_guarded")

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
    "examples/counterweight": "terms that switch",
    "examples/ligament_proved": "X, or own states, are left",
    "examples/driven": "an element supplies power",
}


def config_of(name):
    return load_config(CONFIGS / f"{name}.yaml", allow_python=True)


def asked(proof, config):
    return {
        (finding.about, finding.claim): finding.verified
        for finding in second_opinion(proof, config)
    }


def confirm(name):
    config = config_of(name)
    proof = prove(config)
    assert proof.proved
    opinions = asked(proof, config)
    decided = [fine for (_, claim), fine in opinions.items() if claim != UNDECIDED]
    assert all(decided), opinions
    assert len(decided) == len(opinions)
    assert opinions["codac: the config", "energy"]
    for states, place in ((proof, "the range of eq. 5"), (proof.unwrapped, "all θ1 and θ3")):
        claims = [claim for about, claim in opinions if about == f"codac: {place}"]
        if states is None:
            assert not claims
        else:
            regions = ["certified region"] * (states.region is not None)
            assert claims == ["rest states", *regions]


@pytest.mark.slow
@pytest.mark.parametrize("name", QUICK)
def test_a_shipped_proof_is_confirmed(name):
    confirm(name)


@pytest.mark.heavy
@pytest.mark.parametrize("name", HEAVY)
def test_all_shipped_proofs_that_it_can_decide_are_confirmed(name):
    confirm(name)


@pytest.fixture(scope="module")
def config():
    return config_of("examples/stability/fast")


@pytest.fixture(scope="module")
def proof(config):
    """Return the only rest state in the range of eq. 5, with its region."""
    return prove(config).model_copy(update={"unwrapped": None})


def changed(proof, **entries):
    return Proof.model_validate({**proof.model_dump(mode="json"), **entries})


def refuted(proof, config):
    opinions = asked(proof, config).items()
    return [claim for (_, claim), fine in opinions if not fine and claim != UNDECIDED]


@pytest.mark.slow
def test_a_proof_is_confirmed_and_one_without_a_state_is_refuted(proof, config):
    assert all(asked(proof, config).values())
    without = changed(proof, states=[], unique=False, closed=None, region=None, regions=[])
    assert refuted(without, config) == ["rest states"]


def moved(data, axis, far):
    for corner in data["states"][0]["enclosure"]:
        corner[axis] += far


def zero_on_border(data):
    low, high = data["states"][0]["enclosure"]
    low[0], high[0] = 0.0, high[0] - low[0]


def index(data):
    data["states"][0]["index"] = 1


def level(data):
    data["region"]["energy_bound"] += 1e-4 * data["region"]["lower_bound"]


WRONG: dict[str, tuple[Callable[[dict[str, Any]], None], list[str]]] = {
    "first angle": (lambda data: moved(data, 0, 1e-6), ["rest states"]),
    "second angle": (lambda data: moved(data, 1, 0.02), ["rest states"]),
    "third angle": (lambda data: moved(data, 2, -1e-6), ["rest states"]),
    "zero on the border": (zero_on_border, []),
    "index": (index, ["rest states"]),
    "level": (level, ["certified region"]),
}


@pytest.mark.slow
@pytest.mark.parametrize("wrong", WRONG)
def test_wrong_claims_are_refuted(proof, config, wrong):
    change, claims = WRONG[wrong]
    data = proof.model_dump(mode="json")
    change(data)
    wrong_proof = changed(proof, **data)
    assert refuted(wrong_proof, config) == claims
    assert not all(asked(wrong_proof, config).values())


@pytest.mark.slow
def test_a_level_that_is_almost_attained_is_left_open():
    """It is true, but so near to the least U on the border that the solver leaves boxes."""
    given = config_of("examples/permanent_gravity_origin")
    data = prove(given).model_copy(update={"unwrapped": None}).model_dump(mode="json")
    region = data["region"]
    region["energy_bound"] = region["energy"] - 1e-12 * region["level"]
    findings = second_opinion(Proof.model_validate(data), given)
    assert [finding.claim for finding in findings if not finding.verified] == [UNDECIDED]


@pytest.mark.slow
@pytest.mark.parametrize("part", ["energy", "slopes"])
def test_an_energy_that_is_not_that_of_the_equations_is_refuted(proof, config, monkeypatch, part):
    """Values come from the equations in doubles, slopes from codac's own derivative of U."""
    answers = opinion.answers

    def of_a_wrong_one(data):
        last = data["energy"][-1] if part == "energy" else data["slopes"][2][-1]
        last[-2] = str(Fraction(last[-2]) * (1 + Fraction(1, 10**6)))
        return answers(data)

    monkeypatch.setattr(opinion, "answers", of_a_wrong_one)
    (finding,) = second_opinion(proof, config)
    assert (finding.about, finding.claim, finding.verified) == (
        "codac: the config",
        "energy",
        False,
    )


@pytest.mark.slow
def test_the_equations_are_those_of_the_config(proof, config):
    """The stored energy has no effect: codac is asked about that of the config."""
    softer = load_config(config, ["controller.K_r[1]=399"], allow_python=True)
    assert refuted(proof, softer) == ["certified region"]


def test_what_takes_too_long_is_not_decided(proof, config, monkeypatch):
    monkeypatch.setattr(opinion, "LATEST", 0.01)
    (finding,) = second_opinion(proof, config)
    assert (finding.claim, finding.verified) == (UNDECIDED, False)
    assert finding.text == "The others: It took too long."
    verified = verify(proof, config, second=True)
    assert verified.takes_too_long
    assert verified.outcome == "not decided: codac does not decide every claim"


@pytest.mark.parametrize(("name", "why"), UNDECIDED_CONFIGS.items(), ids=list(UNDECIDED_CONFIGS))
def test_what_codac_is_not_asked_has_its_reason(proof, name, why):
    (finding,) = second_opinion(proof, config_of(name))
    assert (finding.about, finding.claim, finding.verified) == ("codac", UNDECIDED, False)
    assert why in finding.text


def test_code_that_may_not_run_is_not_asked_about(proof, monkeypatch):
    config = config_of("examples/magnet")
    monkeypatch.setattr("rbstab.experiment.verification.verify.may_build", lambda _: False)
    (finding,) = second_opinion(proof, config)
    assert finding.claim == UNDECIDED
    assert "--allow-python" in finding.text


def test_codac_is_not_imported_here():
    """It would round the whole process upward."""
    code = "import sys, rbstab.experiment.verification.verify; print('codac' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"
