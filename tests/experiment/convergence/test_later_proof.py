"""A stored run together with a proof that was made later says what a run with this proof says."""

import dataclasses
import math

import numpy as np
import pytest
from support.configs import PERMANENT, VISCO_ELASTIC, plain

import rbstab
from rbstab.analysis.certificate.verdict import Check, Verdict
from rbstab.experiment.convergence import with_proof
from rbstab.experiment.convergence.convergence import Enclose
from rbstab.experiment.convergence.with_proof import _strength, with_later_proof
from rbstab.experiment.proof import prove
from rbstab.experiment.run_certificate import (
    CERTIFIED_REGION,
    GLOBAL_STABILITY,
    LEAST_REST_STATES,
    REST_STATES,
    rest_state_check,
)
from rbstab.experiment.stored_run import certificate_lines

SHORT = ("integration.duration=0.2", "integration.samples=11")


@pytest.fixture(scope="module")
def config():
    """A held body that starts inside of its certified region."""
    return rbstab.load_config(plain(PERMANENT), (*SHORT, "initial.angular_velocity=[1,2,-1]"))


@pytest.fixture(scope="module")
def proof(config):
    """The proof of its rest states."""
    return prove(config)


def same(first, second):
    """Whether two results say the same, but for the times that they took."""
    times = {"wall_time", "compile_time", "created"}
    texts = [
        {k: v for k, v in result.attributes.items() if k not in times} for result in (first, second)
    ]
    lines = [str(certificate_lines(result)) for result in (first, second)]
    return texts[0] == texts[1] and lines[0] == lines[1]


def test_it_is_the_run_with_this_proof(config, proof):
    without, with_proof = rbstab.simulate(config), rbstab.simulate(config, proof=proof)
    assert not same(without, with_proof)
    now = with_later_proof(without, config, proof)
    assert same(now, with_proof)
    # A second time it says no more, and the result stays as it is.
    assert with_later_proof(now, config, proof) is now
    assert with_later_proof(with_proof, config, proof) is with_proof


def test_code_of_users_is_not_run_for_it(config, proof, monkeypatch):
    without = rbstab.simulate(config)
    monkeypatch.setattr(with_proof, "has_code", lambda _: True)
    assert with_later_proof(without, config, proof) is without


def test_a_motion_that_was_followed_stays_proved(proof, config):
    """The start alone proves less."""
    fast = rbstab.load_config(plain(PERMANENT), (*SHORT, "initial.angular_velocity=[16,32,-16]"))
    followed = rbstab.simulate(fast, proof=proof, enclose=Enclose.UNTIL_PROVED)
    assert followed.attributes["convergence"] == "proved"
    names = {"global stability": math.nan, "certified region": math.nan}
    values = followed["certificate/value"].copy()
    values[[str(name) in names for name in followed["certificate/check"]]] = np.nan
    old = followed.variables["certificate/value"]._replace(data=values)
    forgotten = dataclasses.replace(
        followed, variables=followed.variables | {"certificate/value": old}
    )
    now = with_later_proof(forgotten, fast, proof)
    assert now is not forgotten
    assert now.attributes["convergence_time"] == followed.attributes["convergence_time"]


def test_a_search_that_found_all_replaces_one_that_did_not(config, proof):
    early = proof.model_copy(
        update={"proved": False, "unique": None, "region": None, "regions": (), "unwrapped": None}
    )
    run = rbstab.simulate(config, proof=early)
    (stable,) = [line for line in certificate_lines(run) if line.check == "global stability"]
    assert (stable.verdict, stable.value) == ("unknown", 1.0)
    assert same(with_later_proof(run, config, proof), rbstab.simulate(config, proof=proof))
    # A search that found less takes nothing away.
    full = rbstab.simulate(config, proof=proof)
    assert with_later_proof(full, config, early) is full


def test_rest_states_of_a_search_that_ended_are_at_least_so_many(proof):
    state = proof.states[0]
    other = state.model_copy(update={"proved": False, "enclosure": None})
    incomplete = proof.model_copy(
        update={"proved": False, "unique": False, "states": (state, state, other)}
    )
    check = rest_state_check(incomplete)
    assert (str(check.verdict), check.value) == ("violated", 2.0)
    assert check.quantity == LEAST_REST_STATES


def test_v_minus_work_has_its_name():
    sliding = rbstab.load_config(
        plain(VISCO_ELASTIC),
        (
            *SHORT,
            "controller={variant: sliding, K_t: [4100,4100,3280], L_t: [200,200,140], "
            "K_r: [400,400,320], L_r: [60,60,42], K_s: [2000,2000,2000], surface: {slope: 20}}",
        ),
    )
    words = {line.check: line.quantity for line in certificate_lines(rbstab.simulate(sliding))}
    assert words["positive"] == "min (v - ε) / largest energy"
    assert words["decrease"] == "largest rise of v - ε between samples / largest energy"


def check(name, verdict, value, quantity=REST_STATES):
    """Return a check of a number of rest states, or of a level."""
    return Check(name, verdict, value, value, math.nan, quantity)


STABLE, REGION = GLOBAL_STABILITY, CERTIFIED_REGION
UNKNOWN, CERTIFIED, VIOLATED = Verdict.UNKNOWN, Verdict.CERTIFIED, Verdict.VIOLATED


@pytest.mark.parametrize(
    ("stored", "new", "kept"),
    [
        # A shorter proof has counted fewer rest states, or no region.
        (check(STABLE, VIOLATED, 3), check(STABLE, VIOLATED, 2, LEAST_REST_STATES), True),
        (check(STABLE, CERTIFIED, 1), check(STABLE, UNKNOWN, 1), True),
        (check(REGION, CERTIFIED, 2.0), check(REGION, UNKNOWN, math.nan), True),
        (check(REGION, CERTIFIED, 2.0), check(REGION, UNKNOWN, 2.0), True),
        # A longer one has more.
        (check(STABLE, UNKNOWN, math.nan), check(STABLE, UNKNOWN, 2), False),
        (check(STABLE, VIOLATED, 9, LEAST_REST_STATES), check(STABLE, VIOLATED, 12), False),
        (check(REGION, UNKNOWN, math.nan), check(REGION, UNKNOWN, 2.0), False),
        (check(REGION, UNKNOWN, 2.0), check(REGION, CERTIFIED, 2.0), False),
    ],
)
def test_a_shorter_proof_takes_nothing_away(stored, new, kept):
    assert max(stored, new, key=_strength) is (stored if kept else new)
