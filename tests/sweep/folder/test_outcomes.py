"""Protects the outcomes of members: they follow from the stored columns and from what is wanted."""

import math
from typing import Any

import numpy as np
import pytest
from support.leg import WEIGHT_MOMENT, leg
from support.sweeping import run_sweep

import rbstab
from rbstab.experiment.answers.outcome import KINDS
from rbstab.integrate.status import RunStatus
from rbstab.mechanics.attitude import rotation
from rbstab.store.table import Table, columns_from
from rbstab.store.variables import RUN
from rbstab.sweep.folder.member_answers import member_answers
from rbstab.sweep.folder.outcomes import SPEEDS, pose_numbers, with_outcomes
from rbstab.sweep.members.outcome import COLUMNS, STATUSES
from rbstab.sweep.plan.load import load_plan

NAN = math.nan

UPSIDE = 40.0
"""The pitch of an unstable rest state in a made table, degrees."""


def table_of(rows, speed=1.0):
    """Return a table of members: status, settling time, pitch at rest and at the end, degrees.

    speed is that at the end of each, rad/s and m/s.
    """
    status, settling, rest, end = zip(*rows, strict=True)
    names = [
        *("status", "settling_time", "end_time"),
        *("rest_orientation", "rest_unstable", "final_orientation"),
        *SPEEDS,
    ]
    arrays: dict[str, Any] = {
        RUN: np.arange(len(rows)),
        "status": np.array([STATUSES.index(word) for word in status], np.int8),
        "settling_time": np.array(settling),
        "end_time": np.ones(len(rows)),
        "rest_orientation": np.radians([[0, angle, 0] for angle in rest]),
        "final_orientation": np.radians([[0, angle, 0] for angle in end]),
        "rest_unstable": np.array([angle == UPSIDE for angle in rest], np.int8),
        **{name: np.full((len(rows), 3), speed) for name in SPEEDS},
    }
    return Table(columns_from({name: COLUMNS[name] for name in names}, arrays), {})


def plan_of(vary, base, engine="heyoka"):
    return load_plan({"base": base, "vary": vary}, [f"integration.engine={engine}"])


def swept(path, plan):
    return run_sweep(path, plan, factory=None, shard_size=None).folder


def test_kinds_follow_from_status_rest_and_tilt():
    rows = [
        (RunStatus.COMPLETED, 1.0, 9.9, 3.0, "returns", 9.9, 1),
        (RunStatus.COMPLETED, 1.0, 10.01, 3.0, "rests_elsewhere", 10.01, 2),
        # 1e-3 rad are 0.057°: this is the pose of the member before.
        (RunStatus.COMPLETED, 1.0, 10.05, 3.0, "rests_elsewhere", 10.05, 2),
        (RunStatus.COMPLETED, 1.0, UPSIDE, 3.0, "at_unstable_rest", UPSIDE, 3),
        (RunStatus.COMPLETED, NAN, 0.0, 3.0, "moving", 3.0, 0),
        # v was small before, but the run ended early.
        (RunStatus.RANGE_LEFT, 1.0, 0.0, 89.9, "left_range", 89.9, 0),
        *((status, NAN, NAN, NAN, "failed", NAN, 0) for status in STATUSES[2:]),
    ]
    table = with_outcomes(table_of([row[:4] for row in rows]), None)
    assert table.words("outcome").tolist() == [row[4] for row in rows]
    assert np.degrees(table["final_tilt"]) == pytest.approx([row[5] for row in rows], nan_ok=True)
    assert table["rest_state"].tolist() == [row[6] for row in rows]
    assert "2 rests elsewhere" in repr(table)
    assert set(KINDS) == set(table.words("outcome"))


@pytest.mark.parametrize(
    ("speed", "rest", "kind"),
    [(9e-5, NAN, "rests_elsewhere"), (2e-4, NAN, "moving"), (9e-5, 0.0, "moving")],
)
def test_where_no_rest_state_was_found_a_member_without_speed_stands_still(speed, rest, kind):
    table = with_outcomes(table_of([(RunStatus.COMPLETED, NAN, rest, 89.9)], speed), None)
    assert table.words("outcome").tolist() == [kind]


def test_the_tilt_is_measured_from_the_desired_attitude():
    desired = {"orientation": {"deg": [0, 60, 0]}, "within": {"deg": 5}}
    plan = plan_of({"body.mass": {"values": [3.0, 3.5]}}, leg(desired=desired))
    rows = [(RunStatus.COMPLETED, 1.0, 0.0, 0.0), (RunStatus.COMPLETED, 1.0, 58.0, 58.0)]
    table = with_outcomes(table_of(rows), plan)
    assert table.words("outcome").tolist() == ["rests_elsewhere", "returns"]
    assert np.degrees(table["final_tilt"]) == pytest.approx([60.0, 2.0])
    assert table["rest_state"].tolist() == [2, 1]


def test_poses_are_numbered_by_tilt_and_turns_do_not_matter():
    pitch, chosen = np.radians([30.0, 0.0, -30.0, 0.0, 30.0, 0.0]), np.ones(6, bool)
    poses = np.stack([np.zeros(6), pitch, np.zeros(6)], axis=1)
    poses[3, 2] = 2 * np.pi
    chosen[5] = False
    tilts = np.abs(pitch)
    first, second, third, fourth, fifth, last = pose_numbers(poses, tilts, chosen)
    assert second == fourth == 1
    assert first == fifth
    assert {first, third} == {2, 3}
    assert last == 0
    assert rotation(poses[1]) == pytest.approx(rotation(poses[3]))


@pytest.mark.heavy
def test_the_stiffness_at_which_a_leg_stands(tmp_path):
    """Upright is stable for K_r > m g l; below, it leans by θ with K_r θ = m g l sin θ."""
    vary = {
        "controller.K_r": {"scale": {"linspace": [0.4, 1.2, 17]}},
        "initial.angular_velocity[1]": {"linspace": [-2, 2, 3]},
    }
    file = run_sweep(
        tmp_path / "a", plan_of(vary, leg()), factory=None, shard_size=None
    ).folder.sweep_file
    table = rbstab.open_sweep(file)
    assert list(table.columns)[2:6] == ["outcome", "final_tilt", "rest_state", "status"]
    stiffness, kinds = 10 * table["controller_K_r"], table.words("outcome")
    assert (stiffness[kinds == "returns"] > WEIGHT_MOMENT).all()
    leaning = kinds == "rests_elsewhere"
    assert (stiffness[leaning] < WEIGHT_MOMENT).all()
    tilts = table["final_tilt"][leaning]
    # Its knee gives way a little: K_c is finite.
    assert stiffness[leaning] * tilts == pytest.approx(WEIGHT_MOMENT * np.sin(tilts), rel=0.02)
    outcomes = member_answers(file).outcomes
    first, middle, last = outcomes.deciding.split("; ", 2)
    assert first == "returns by 5 s for K_r[0] ≥ 7.0 N m/rad"
    assert middle.startswith("still moving at 5 s at 6.5")
    assert "rests elsewhere for ≤ 6.0" in last
    assert outcomes.sentence.startswith(f"returns: {np.sum(kinds == 'returns')} of 51 members; ")


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["heyoka", "scipy"])
@pytest.mark.parametrize("start", [[0, 0, 0], [0, 0.1, 0]])
def test_a_leg_that_would_fall_about_one_axis_is_not_said_to_return(tmp_path, engine, start):
    """It never moves about x, where a spring of less than m g l does not hold it."""
    vary = {"controller.K_r[0]": {"values": [5.0, 6.3, 6.5, 8.0]}}
    controller = {"variant": "permanent", "K_r": [8, 20, 5], "L_r": [2, 2, 2]}
    base = leg(controller=controller, initial={"orientation": start})
    file = swept(tmp_path / "a", plan_of(vary, base, engine)).sweep_file
    table = rbstab.open_sweep(file)
    expected = ["at_unstable_rest"] * 2 + ["returns"] * 2
    assert table.words("outcome").tolist() == expected
    outcomes = member_answers(file).outcomes
    assert outcomes.deciding.startswith(
        "returns by 5 s for K_r[0] ≥ 6.5 N m/rad; at an unstable rest"
    )
    assert "at an unstable rest state: 2" in outcomes.sentence


@pytest.mark.slow
@pytest.mark.parametrize(
    ("signal", "expected"),
    [
        ({"kind": "constant"}, ["returns", "rests_elsewhere"]),
        ({"kind": "sine", "frequency": 1.0}, ["moving", "moving"]),
    ],
)
def test_members_that_stand_under_a_load_are_not_moving(tmp_path, signal, expected):
    """A couple M about y: K θ = m g l sin θ + M."""
    push = {"kind": "input", "quantity": "couple", "direction": [0, 1, 0], "amplitude": 1.0}
    controller = {"variant": "permanent", "K_r": [10, 10, 5], "L_r": [0.8, 0.8, 0.3]}
    base = leg(controller=controller, initial={}, elements={"push": push | {"signal": signal}})
    base["integration"]["duration"] = 8
    plan = plan_of({"elements.push.amplitude": {"values": [0.5, 1.5]}}, base)
    table = rbstab.open_sweep(swept(tmp_path / "a", plan).path)
    assert table.words("outcome").tolist() == expected
    if "moving" not in expected:
        tilts = table["final_tilt"]
        assert 10 * tilts - WEIGHT_MOMENT * np.sin(tilts) == pytest.approx([0.5, 1.5], abs=1e-6)
        assert table["rest_state"].tolist() == [1, 2]


@pytest.mark.heavy
def test_starts_of_one_body_are_grouped_by_the_pose_they_reach(tmp_path):
    vary = {"initial.angular_velocity[1]": {"values": [-3.0, -2.5, 2.0, 2.5]}}
    base = leg(5.0, initial={"orientation": [0, 0, 0], "attached": True})
    table = rbstab.open_sweep(
        run_sweep(tmp_path / "a", plan_of(vary, base), factory=None, shard_size=None).folder.path
    )
    left, left_too, right, right_too = table["rest_state"]
    assert left == left_too != right == right_too
    # 5 θ = 6.386 sin θ
    assert np.degrees(table["final_tilt"]) == pytest.approx([67.7] * 4, abs=0.1)


@pytest.mark.heavy
def test_a_new_wish_changes_outcomes_and_no_identity(tmp_path):
    vary = {"initial.angular_velocity[1]": {"values": [0.0, 0.1]}}
    seen = []
    wishes: list[dict[str, Any]] = [{}, {"desired": {"orientation": {"deg": [0, 45, 0]}}}]
    for desired in wishes:
        folder = swept(tmp_path / "a", plan_of(vary, leg(**desired), "scipy"))
        table, shard = rbstab.open_sweep(folder.path), folder.shard_file(0)
        kept = (table.attributes["plan_id"], shard.read_bytes(), shard.stat().st_mtime_ns)
        seen.append((table.words("outcome").tolist(), kept))
    (before, kept), (after, kept_too) = seen
    assert before == ["returns", "returns"]
    assert after == ["rests_elsewhere", "rests_elsewhere"]
    assert kept == kept_too


@pytest.mark.parametrize("weight", [9.81, 0.0])
def test_members_rest_where_they_are_on_a_family_of_rest_states(tmp_path, weight):
    """A held body turns about its axis by J₃ω/L₃ before it rests: each pose is a rest state."""
    zero = [0, 0, 0]
    held = {"variant": "permanent", "K_t": zero, "L_t": zero, "K_r": zero, "L_r": [6, 6, 4]}
    body = {"mass": 12, "inertia": [0.29, 0.34, 0.13], "contact_point": [0, 0, 0.25]}
    base = leg(body=body, controller=held, initial={}, gravity=[0, 0, -weight])
    base["integration"] = {"duration": 5}
    spins = np.array([0.2, 0.6, 1.2, 2.0])
    vary = {"initial.angular_velocity[2]": {"values": spins.tolist()}}
    if not weight:
        # Its rest states differ from those of the base, for all that is known.
        base["initial"] = {"angular_velocity": [0, 0, 1.2]}
        vary = {"controller.L_r[2]": {"values": (4 * 1.2 / spins).tolist()}}
    table = rbstab.open_sweep(swept(tmp_path / "a", plan_of(vary, base)).sweep_file)
    assert table["final_tilt"] == pytest.approx(0.13 * spins / 4, rel=2e-3)
