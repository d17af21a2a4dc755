"""Protects the column `convergence`: members that share a proof agree with their single runs."""

from typing import Any

import pytest
from support.paper_runs import paper_config

import rbstab
from rbstab.experiment.proof_cache import proof_for
from rbstab.sweep.members.convergence import CONVERGENCE, ProvedConvergence
from rbstab.sweep.members.single import SingleRuns
from rbstab.sweep.plan.load import load_plan

SHORT: dict[str, Any] = {"duration": 0.01, "samples": 3, "rtol": 1e-8}
SPIN = "initial.angular_velocity[0]"


def plan_of(vary, with_gravity=True):
    base = paper_config("free", with_gravity, initial={"angular_velocity": [0, 0, 0]}, **SHORT)
    return load_plan({"base": base, "vary": vary})


def words(plan, folder):
    found = SingleRuns(plan).compute(0, plan.members).outcome
    codes = ProvedConvergence(plan, folder).of(
        0, plan.members, found["lyapunov_start"], found["energy_at_rest"]
    )
    return [CONVERGENCE[code] for code in codes]


@pytest.mark.parametrize("with_gravity", [False, True])
def test_inside_and_outside_are_those_of_single_runs(tmp_path, with_gravity):
    plan = plan_of({SPIN: {"values": [1.0, 8.0, 9.92, 9.94, 12.0]}}, with_gravity)
    proof = proof_for(tmp_path, plan.base_of("free"))
    found = [
        rbstab.simulate(plan.config_of(k), proof=proof).attributes["convergence"] for k in range(5)
    ]
    expected = ["proved" if word == "proved" else "not proved" for word in found]
    assert words(plan, tmp_path) == expected
    assert set(expected) == {"proved", "not proved"}


def test_without_a_proof_nothing_is_said(tmp_path):
    assert words(plan_of({SPIN: {"values": [1.0, 2.0]}}), tmp_path) == ["unknown", "unknown"]


def test_members_that_do_not_share_the_proof_are_not_judged_by_it(tmp_path):
    plan = plan_of({"body.mass": {"values": [41.0, 42.0]}})
    proof_for(tmp_path, plan.base_of("free"))
    assert words(plan, tmp_path) == ["unknown", "unknown"]
