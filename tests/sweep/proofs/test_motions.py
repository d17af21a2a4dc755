"""Protects `prove: motion`: members are proved by their exact motions, and never falsely."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.paper_runs import paper_config
from support.sweeping import run_sweep
from support.valleys import TWO_VALLEYS

import rbstab
from rbstab.experiment.convergence.convergence import Undecided
from rbstab.experiment.convergence.many_motions import Motions
from rbstab.experiment.proof import prove
from rbstab.experiment.proof_cache import proof_file
from rbstab.report.sweeps.proofs import REASONS
from rbstab.sweep.members.engines import factory_for
from rbstab.sweep.members.single import SingleRuns
from rbstab.sweep.plan.load import load_plan
from rbstab.sweep.proofs import motions
from rbstab.sweep.proofs.columns import FIRST_UNDECIDED, MOTION_PROOFS
from rbstab.sweep.proofs.motions import MotionProver

EXAMPLES = Path(__file__).parents[3] / "configs" / "examples"

SPIN = "initial.angular_velocity[0]"
SHORT: dict[str, Any] = {"duration": 0.1, "samples": 5, "rtol": 1e-9}


def spun(speeds, prove="motion", **changes):
    """A plan of the paper's free body with some initial spins. It is proved at once below 9.9."""
    base = paper_config("free", initial={"angular_velocity": [0, 0, 0]}, **SHORT)
    return load_plan({"base": base, "vary": {SPIN: {"values": speeds}}, "prove": prove, **changes})


def columns_of(plan, start=0, stop=None):
    assert plan.prove is not None
    stop = plan.members if stop is None else stop
    return MotionProver(plan, plan.prove).columns(start, stop)


def words(columns):
    return [MOTION_PROOFS[code] for code in columns["motion_proof"]]


@pytest.fixture(scope="module")
def valleys():
    """A plan of starts above the pass between two valleys, and what is proved of them."""
    vary = {SPIN: {"values": [-11.0, 10.0, 11.0, 12.0, 14.0]}}
    base = TWO_VALLEYS | {"initial": {"orientation": [-0.5, 0, 0]}}
    plan = load_plan({"base": base, "vary": vary, "prove": "motion"})
    return plan, columns_of(plan)


def test_proved_states_are_those_in_which_the_computed_motions_end(valleys):
    plan, columns = valleys
    assert words(columns) == ["proved"] * 5
    assert set(columns["proved_rest_state"]) == {1, 2}
    states = prove(plan.base_of("permanent")).states
    ends = SingleRuns(plan).compute(0, plan.members).outcome["final_orientation"]
    for end, number in zip(ends, columns["proved_rest_state"], strict=True):
        assert np.abs(end - states[number - 1].orientation).max() < 1e-2


def test_starts_in_a_region_need_no_enclosure():
    columns = columns_of(spun([1.0, 12.0]))
    assert words(columns) == ["not enclosed", "proved"]
    assert columns["proved_rest_state"].tolist() == [1, 1]
    assert columns["proved_time"][0] == 0
    assert columns["proved_time"][1] > 0
    assert columns["proof_steps"][0] == 0


def test_the_limit_of_steps_leaves_members_undecided():
    (steps,) = columns_of(spun([12.0]))["proof_steps"]
    enough, short = ({"motion": {"steps": int(steps) - k}} for k in (0, 1))
    assert words(columns_of(spun([12.0], enough))) == ["proved"]
    columns = columns_of(spun([12.0], short))
    assert words(columns) == ["step limit"]
    assert columns["proved_rest_state"].tolist() == [0]
    assert np.isnan(columns["proved_time"]).all()
    assert columns["proof_steps"].tolist() == [steps - 1]


def test_only_selected_members_are_enclosed():
    plan = spun([12.0, 12.5, 13.0], {"motion": {"members": 1}})
    answers = words(columns_of(plan))
    assert sorted(answers) == ["not enclosed", "not enclosed", "proved"]


def test_what_is_found_does_not_depend_on_the_division():
    plan = spun([1.0, 12.0, 13.0])
    whole = columns_of(plan)
    parts = [columns_of(plan, k, k + 1) for k in range(3)]
    for name, column in whole.items():
        assert np.concatenate([part[name] for part in parts]).tobytes() == column.tobytes(), name


def test_an_error_leaves_the_members_of_other_bodies_alone(monkeypatch):
    base = paper_config("free", initial={"angular_velocity": [12.0, 0, 0]}, **SHORT)
    vary = {"controller.K_r": {"scale": {"values": [1.0, 0.9, 0.8]}}}
    plan = load_plan({"base": base, "vary": vary, "prove": "motion"})

    def failing(config, *arguments):
        if config.title.endswith("member 1"):
            raise ZeroDivisionError("made up")
        return prove(config, *arguments)

    monkeypatch.setattr(motions, "prove", failing)
    columns = columns_of(plan)
    assert words(columns) == ["proved", "failed", "proved"]
    assert columns["proved_rest_state"].tolist() == [1, 0, 1]
    assert np.isnan(columns["proved_time"][1])

    def failing_together(*_):
        raise FloatingPointError("made up")

    monkeypatch.setattr(Motions, "follow_all", failing_together)
    assert words(columns_of(spun([1.0, 12.0]))) == ["not enclosed", "failed"]


def test_sliding_members_are_not_decided():
    base = str(EXAMPLES / "sliding" / "position_layer_20000.yaml")
    plan = load_plan({"base": base, "vary": {SPIN: {"values": [0.0]}}, "prove": "motion"})
    assert words(columns_of(plan)) == ["sliding"]


def test_other_bodies_have_their_own_proofs(tmp_path):
    base = paper_config("free", initial={"angular_velocity": [12.0, 0, 0]}, **SHORT)
    vary = {"controller.K_r": {"scale": {"values": [1.0, 0.9]}}}
    plan = load_plan({"base": base, "vary": vary, "prove": "motion"})
    run_sweep(tmp_path / "sweep", plan, threads=1)
    table = rbstab.open_sweep(tmp_path / "sweep")
    assert table.words("convergence").tolist() == ["proved", "proved"]
    assert table["proof_steps"].min() > 0
    assert len(set(table["proved_time"].tolist())) == 2
    assert not (tmp_path / "proofs").exists()


def test_a_sweep_with_proofs(tmp_path):
    plan = load_plan(
        {
            "base": paper_config("free", initial={"angular_velocity": [0, 0, 0]}, **SHORT),
            "vary": {SPIN: {"values": [1.0, 12.0, 200.0]}},
            "prove": {"motion": {"steps": 30}},
        },
        ["integration.engine=scipy"],
    )
    run_sweep(tmp_path / "sweep", plan, factory=factory_for("scipy"))
    table = rbstab.open_sweep(tmp_path / "sweep")
    assert table.words("convergence").tolist()[:2] == ["proved", "proved"]
    assert table.words("convergence")[2] == "not decided"
    assert table["proved_rest_state"].tolist() == [1, 1, 0]
    assert table["proved_time"][0] == 0
    assert np.isnan(table["proved_time"][2])
    assert proof_file(tmp_path, plan.base_of("free")).is_file()


def test_every_reason_has_a_code_and_words():
    """Otherwise a member that is not decided for this reason could not be stored, or reported."""
    enclosed = {str(reason) for reason in Undecided if reason is not Undecided.OUTSIDE}
    assert enclosed <= set(MOTION_PROOFS)
    assert set(REASONS) == set(MOTION_PROOFS[FIRST_UNDECIDED:])


def test_driven_members_are_not_decided():
    base = {"schema_version": 2, **paper_config("free", **SHORT)}
    base["elements"] = {
        "wind": {
            "kind": "input",
            "quantity": "couple",
            "direction": [0, 0, 1],
            "amplitude": 1.0,
            "signal": {"kind": "constant"},
        }
    }
    vary = {"elements.wind.amplitude": {"values": [1.0, 2.0]}}
    plan = load_plan({"base": base, "vary": vary, "prove": "motion"})
    assert words(columns_of(plan)) == ["input"] * 2
