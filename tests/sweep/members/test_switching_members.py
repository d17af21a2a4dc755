"""Members with elements that switch are single runs, of either engine, also in heyoka's batches."""

import numpy as np
import pytest
from support.sliding_ties import tie
from support.switching import ENGINES, data, guard, ligament

from rbstab.config.build import problem_of
from rbstab.experiment.simulate import simulate
from rbstab.sweep.members.engines import factory_for
from rbstab.sweep.members.ensemble import EnsembleEngine
from rbstab.sweep.members.outcome import STATUSES
from rbstab.sweep.members.single import SingleRuns
from rbstab.sweep.plan.load import load_plan
from rbstab.systems.modes import modes_of

STIFFNESSES = [40.0, 80.0, 160.0]


ELEMENTS = {"a": ligament(-1.0, damping=2.0), "soft": guard("stiff", 40.0, 0.1)}


def plan_of(engine_name, elements=ELEMENTS, **plan):
    controller = {"variant": "free", "K_t": [40, 50, 60], "L_t": [4, 5, 6]}
    controller |= {"K_r": [30, 40, 50], "L_r": [3, 4, 5]}
    base = data(
        elements,
        {"velocity": [4.1, 0.3, 0], "angular_velocity": [0, 1.5, 0]},
        {"duration": 3.0, "samples": 61, "engine": engine_name, "rtol": 1e-12},
        controller=controller,
    )
    vary = {"elements.a.stiffness": {"values": STIFFNESSES}}
    return load_plan({"base": base, "vary": vary} | plan)


@pytest.mark.parametrize("engine_name", ENGINES)
def test_each_member_is_its_single_run(engine_name):
    plan = plan_of(engine_name)
    found = factory_for(engine_name)(plan).compute(0, 3).outcome
    for member in range(3):
        run = simulate(plan.config_of(member))
        assert STATUSES[found["status"][member]] == run.status == "completed"
        assert run.attributes["verdict"] == "consistent"
        assert found["steps"][member] == run.attributes["steps"]
        for name in ("orientation", "position"):
            assert (found[f"final_{name}"][member] == run[name][-1]).all()
        assert found["lyapunov_start"][member] == run["lyapunov"][0]
    # The stiffness has an effect: the ligament goes taut in each of them.
    assert len(np.unique(found["peak_contact_displacement"][:, 0])) == 3


def test_the_engines_find_the_same_members():
    found = [factory_for(name)(plan_of(name)).compute(0, 3).outcome for name in ENGINES]
    for name in ("final_orientation", "final_position", "lyapunov_end", "settling_time"):
        scipy, heyoka = (outcome[name] for outcome in found)
        np.testing.assert_allclose(scipy, heyoka, rtol=1e-7, atol=1e-9)
    for name in ("peak_contact_displacement", "peak_orientation"):
        scipy, heyoka = (outcome[name] for outcome in found)
        np.testing.assert_allclose(scipy, heyoka, rtol=1e-5, atol=1e-9)


def test_no_member_runs_in_a_batch():
    plan = plan_of("heyoka")
    assert EnsembleEngine(plan, SingleRuns(plan)).variant_engines == {}
    smooth = data({"x": {"kind": "attitude", "K": [1, 1, 1], "L": [1, 1, 1]}})
    smooth["integration"]["engine"] = "heyoka"
    other = load_plan({"base": smooth, "vary": {"body.mass": {"values": [1.0, 2.0]}}})
    assert len(EnsembleEngine(other, SingleRuns(other)).variant_engines) == 1


def test_convergence_of_members_with_a_sliding_tie_is_not_decided():
    """No proof takes it into account; the column names the reason."""
    from rbstab.sweep.proofs.columns import MOTION_PROOFS
    from rbstab.sweep.proofs.motions import motion_columns
    from rbstab.sweep.proofs.variants import shares_proof

    plan = plan_of("scipy", {"a": ligament(-1.0), "tie": tie()}, prove="motion")
    columns = motion_columns(plan, 0, 3)
    assert [MOTION_PROOFS[code] for code in columns["motion_proof"]] == ["switches"] * 3
    starts = {"initial.velocity[0]": {"values": [1.0, 2.0]}}
    for other in (plan, plan_of("scipy", {"tie": tie()}, vary=starts)):
        assert not any(shares_proof(other, variant) for variant in other.variants)


def test_members_with_a_ligament_and_a_guard_are_proved():
    """At their starts, or by following them through their switches."""
    from rbstab.sweep.proofs.columns import MOTION_PROOFS
    from rbstab.sweep.proofs.motions import motion_columns
    from rbstab.sweep.proofs.variants import shares_proof

    starts = {"initial.velocity[0]": {"values": [0.01, 0.02, 90.0]}}
    plan = plan_of("scipy", prove="motion", vary=starts)
    assert all(shares_proof(plan, variant) for variant in plan.variants)
    columns = motion_columns(plan, 0, 3)
    words = [MOTION_PROOFS[code] for code in columns["motion_proof"]]
    assert words[2] == "proved"
    assert columns["proved_rest_state"].tolist() == [1, 1, 1]
    assert columns["proof_steps"].tolist()[:2] == [0, 0]
    assert columns["proof_steps"][2] > 0


def test_modes_of_a_member_are_those_of_its_own_start():
    assert modes_of(problem_of(plan_of("scipy").config_of(0)).system) == (0, 0, 0, 0)
    taut = data({"a": ligament(-1.0)}, {"position": [0.5, 0, 0]})
    plan = load_plan({"base": taut, "vary": {"initial.position[0]": {"values": [0.1, 0.35, 0.5]}}})
    systems = [problem_of(plan.config_of(member)).system for member in range(3)]
    assert [modes_of(system) for system in systems] == [(0, 0), (1, 0), (1, 1)]
