"""Protects the check of proofs of bounds on disturbances against a config."""

import copy
from fractions import Fraction
from typing import Any

import pytest
from support.config_elements import config_data

import rbstab
from rbstab.experiment.disturbed.prove_bound import stated_in
from rbstab.experiment.disturbed.stored import StoredBound, bound_file, bound_for
from rbstab.experiment.verification.verify import verify
from rbstab.proof.disturbed.forms import Load
from rbstab.proof.disturbed.record import Stated
from rbstab.store.document import read_model

# Without K_t and L_t V has few terms, and proofs are quick.
HELD = {"variant": "permanent", "K_r": [400, 400, 320], "L_r": [60, 60, 42]}
DATA: dict[str, Any] = config_data({}, HELD) | {"gravity": [0, 0, 0], "initial": {}}
DATA |= {"bound": {"couple": 20, "tilt": 0.5}}
CONFIG = rbstab.load_config(DATA)
STATED: Any = stated_in(CONFIG)

GUST = {"kind": "input", "quantity": "couple", "direction": [1, 0, 0], "amplitude": 3}
GUST |= {"signal": {"kind": "sine", "frequency": 1}}


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    folder = tmp_path_factory.mktemp("results")
    bound_for(folder, CONFIG)
    return read_model(bound_file(folder, CONFIG, STATED), StoredBound)


def refused(found):
    return [(one.about, one.claim) for one in found.findings if not one.verified]


@pytest.mark.slow
def test_what_was_proved_is_verified_with_its_config(stored):
    found = verify(stored, CONFIG)
    assert refused(found) == []
    claims = [(one.about, one.claim) for one in found.findings]
    of_config = [("the config", "id"), ("the config", "V and V'")]
    assert claims == [*of_config, ("all disturbances", "bound")]
    alone = verify(stored)
    assert alone.outcome == "verified"
    assert any("not compared with a config" in text for text in alone.unchecked)
    assert not any("not compared with a config" in text for text in found.unchecked)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("sections", "why"),
    [
        ({"controller": {**HELD, "K_r": [400, 400, 321]}}, "V, or V', is differ"),
        ({"controller": {**HELD, "L_r": [60, 60, 43]}}, "V, or V', is differ"),
        ({"gravity": [0, 0, -9.81]}, "does not rest at"),
        ({"desired": {"orientation": [0.1, 0, 0]}}, "the desired attitude is not"),
        ({"schema_version": 2, "elements": {"gust": GUST}}, "one of both has inputs"),
    ],
)
def test_the_proof_of_another_config_is_refused(stored, sections, why):
    found = verify(stored, rbstab.load_config(DATA | sections))
    assert found.outcome == "REFUSED"
    assert ("the config", "id") in refused(found)
    assert any(why in one.text for one in found.findings if not one.verified)


@pytest.mark.slow
def test_another_bound_of_the_config_is_said(stored):
    other = rbstab.load_config(DATA | {"bound": {"couple": 21, "tilt": 0.5}})
    found = verify(stored, other)
    assert found.verified
    assert any("The config states another bound" in text for text in found.unchecked)


def forged(stored, change):
    data = copy.deepcopy(stored.model_dump(mode="json"))
    change(data)
    return StoredBound.model_validate(data)


def _coefficient(data):
    """Change one coefficient of V' a little: what is claimed of this V' is true."""
    (W0, _), operations = data["claim"]["rates"], data["claim"]["operations"]
    operation = operations[W0[2][2]]
    assert operation[0] == "sum"
    operation[1] = str(Fraction(operation[1]) * Fraction(1001, 1000))


def _larger(data):
    data["claim"]["loads"][0]["size"] = "160"


def _smaller_tilt(data):
    data["claim"]["tilt"] = "1/4"


def _acts_as_force(data):
    data["claim"]["loads"][0]["kind"] = "force"


def _no_loads(data):
    data["claim"]["loads"] = "x"


def _not_proved(data):
    data["claim"] = STATED.record


FORGERIES = {
    _coefficient: ("the config", "V and V'"),
    _larger: ("all disturbances", "bound"),
    _smaller_tilt: ("all disturbances", "bound"),
    _acts_as_force: ("the config", "V and V'"),
    _no_loads: ("the config", "V and V'"),
    _not_proved: ("all disturbances", "record"),
}


@pytest.mark.slow
@pytest.mark.parametrize("change", FORGERIES)
def test_a_forged_proof_is_refused(stored, change):
    found = verify(forged(stored, change), CONFIG)
    assert found.outcome == "REFUSED"
    assert FORGERIES[change] in refused(found)


@pytest.mark.slow
def test_a_claim_of_another_version_is_not_decided(stored):
    found = verify(forged(stored, lambda data: data["claim"].update(version=2)), CONFIG)
    assert not found.verified
    assert found.takes_too_long
    assert found.outcome == "not decided: this checker does not know claims of this version"


@pytest.mark.slow
def test_what_is_not_proved_is_not_verified(tmp_path):
    stated = Stated({Load("couple"): Fraction(10**6)}, Fraction(1, 2))
    bound_for(tmp_path, CONFIG, stated)
    stored = read_model(bound_file(tmp_path, CONFIG, stated), StoredBound)
    assert stored.claims_nothing
    found = verify(stored, CONFIG)
    assert "There is no proof: the best V that was found allows" in found.findings[0].text
    assert not found.verified
