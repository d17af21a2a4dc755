"""Proofs and modes of members with elements that switch."""

from support.member_plans import SWITCHING
from support.sliding_ties import tie
from support.switching import data, ligament

from rbstab.config.build import problem_of
from rbstab.sweep.plan.load import load_plan
from rbstab.systems.modes import modes_of


def plan_of(elements=SWITCHING, **plan):
    controller = {"variant": "free", "K_t": [40, 50, 60], "L_t": [4, 5, 6]}
    controller |= {"K_r": [30, 40, 50], "L_r": [3, 4, 5]}
    base = data(
        elements,
        {"velocity": [4.1, 0.3, 0], "angular_velocity": [0, 1.5, 0]},
        {"duration": 3.0, "samples": 61, "rtol": 1e-12},
        controller=controller,
    )
    vary = {"elements.a.stiffness": {"values": [40.0, 80.0, 160.0]}}
    return load_plan({"base": base, "vary": vary} | plan)


def test_convergence_of_members_with_a_sliding_tie_is_not_decided():
    """No proof takes it into account; the column names the reason."""
    from rbstab.sweep.proofs.columns import MOTION_PROOFS
    from rbstab.sweep.proofs.motions import motion_columns
    from rbstab.sweep.proofs.variants import shares_proof

    plan = plan_of({"a": ligament(-1.0), "tie": tie()}, prove="motion")
    columns = motion_columns(plan, 0, 3)
    assert [MOTION_PROOFS[code] for code in columns["motion_proof"]] == ["sliding"] * 3
    starts = {"initial.velocity[0]": {"values": [1.0, 2.0]}}
    for other in (plan, plan_of({"tie": tie()}, vary=starts)):
        assert not any(shares_proof(other, variant) for variant in other.variants)


def test_members_with_a_ligament_and_a_guard_are_proved():
    """At their starts, or by following them through their switches."""
    from rbstab.sweep.proofs.columns import MOTION_PROOFS
    from rbstab.sweep.proofs.motions import motion_columns
    from rbstab.sweep.proofs.variants import shares_proof

    starts = {"initial.velocity[0]": {"values": [0.01, 0.02, 90.0]}}
    plan = plan_of(prove="motion", vary=starts)
    assert all(shares_proof(plan, variant) for variant in plan.variants)
    columns = motion_columns(plan, 0, 3)
    words = [MOTION_PROOFS[code] for code in columns["motion_proof"]]
    assert words[2] == "proved"
    assert columns["proved_rest_state"].tolist() == [1, 1, 1]
    assert columns["proof_steps"].tolist()[:2] == [0, 0]
    assert columns["proof_steps"][2] > 0


def test_modes_of_a_member_are_those_of_its_own_start():
    assert modes_of(problem_of(plan_of().config_of(0)).system) == (0, 0, 0, 0)
    taut = data({"a": ligament(-1.0)}, {"position": [0.5, 0, 0]})
    plan = load_plan({"base": taut, "vary": {"initial.position[0]": {"values": [0.1, 0.35, 0.5]}}})
    systems = [problem_of(plan.config_of(member)).system for member in range(3)]
    assert [modes_of(system) for system in systems] == [(0, 0), (1, 0), (1, 1)]
