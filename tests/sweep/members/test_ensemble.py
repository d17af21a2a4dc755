"""Protects the batch engine: its members agree with single runs, whatever varies."""

from typing import Any

import numpy as np
import pytest
from support.paper_runs import paper_config

from rbstab.config.build import problem_of
from rbstab.integrate.heyoka.symbols import parameters_and_start
from rbstab.sweep.members.approached_states import ApproachedStates, RestStatesOfMembers
from rbstab.sweep.members.binding import Binding
from rbstab.sweep.members.ensemble import EnsembleEngine
from rbstab.sweep.members.outcome import COLUMNS, STATUSES
from rbstab.sweep.members.single import SingleRuns
from rbstab.sweep.plan.load import load_plan

SHORT: dict[str, Any] = {"duration": 0.4, "samples": 21, "rtol": 1e-10, "engine": "heyoka"}


def plan_of(variant="visco-elastic", with_gravity=True, members=20, vary=None, **integration):
    return load_plan(
        {
            "title": "A sweep",
            "base": paper_config(variant, with_gravity, **{**SHORT, **integration}),
            "vary": vary or {"initial.angular_velocity[0]": {"uniform": [-20, 20]}},
            "design": "random",
            "members": members,
            "seed": 3,
        }
    )


VARIED: dict[str, dict[str, Any]] = {
    "spin": {"initial.angular_velocity[0]": {"uniform": [-20, 20]}},
    "attitude": {"initial.orientation[1]": {"uniform": [-0.5, 0.5]}},
    "mass": {"body.mass": {"uniform": [20, 60]}},
    "contact point": {"body.contact_point[2]": {"uniform": [-0.6, 0.2]}},
    "inertia": {"body.inertia": {"scale": {"uniform": [0.7, 1.3]}}},
    "gains": {
        "controller.K_r": {"scale": {"loguniform": [0.3, 3]}},
        "controller.L_t[1]": {"uniform": [100, 300]},
    },
    "gravity": {"gravity[0]": {"normal": [0, 3]}},
}


class RecordedSingleRuns(SingleRuns):
    """Single runs that record the members which the batch engine leaves to them."""

    def __init__(self, plan):
        super().__init__(plan, "heyoka")
        self.indices = []

    def compute(self, start, stop):
        self.indices += range(start, stop)
        return super().compute(start, stop)


def engine_of(plan):
    return EnsembleEngine(plan, RecordedSingleRuns(plan))


def outcome_alone(plan, index):
    return SingleRuns(plan, "heyoka").compute(index, index + 1).outcome


@pytest.mark.parametrize("what", VARIED)
def test_parameters_and_starts_are_those_of_the_configs(what):
    plan = plan_of(vary=VARIED[what])
    binding = Binding(plan, "visco-elastic")
    parameters, starts = binding.parameters_and_starts(plan.values(0, 20))
    values = plan.values(0, 20)
    for k in (0, 19):
        problem = problem_of(plan.config_of(k))
        expected = parameters_and_start(problem.system, problem.start)
        found = np.concatenate([parameters[:, k], starts[:, k]])
        assert found == pytest.approx(expected, rel=1e-15, abs=1e-300)
        row = {key: column[k] for key, column in values.items()}
        assert binding.config_of(row).controller == plan.config_of(k).controller
        assert binding.config_of(row).body == plan.config_of(k).body


@pytest.mark.parametrize("what", VARIED)
def test_members_are_single_runs(what):
    plan = plan_of(vary=VARIED[what])
    engine = engine_of(plan)
    found = engine.compute(0, 20).outcome
    assert engine.single_runs.indices == []
    for index in (0, 7, 19):
        expected = outcome_alone(plan, index)
        for name, column in expected.items():
            if name == "steps" or column.dtype.kind == "S":
                continue
            scale = max(1.0, np.nanmax(np.abs(column))) if np.isfinite(column).any() else 1.0
            assert found[name][index] == pytest.approx(column[0], abs=1e-8 * scale, nan_ok=True), (
                name,
                index,
            )


@pytest.mark.parametrize("variant", ["free", "permanent", "embedded"])
def test_other_variants(variant):
    plan = plan_of(variant)
    found = engine_of(plan).compute(4, 12).outcome
    expected = outcome_alone(plan, 6)
    for name in ("final_orientation", "peak_contact_displacement", "lyapunov_end", "settling_time"):
        assert found[name][2] == pytest.approx(expected[name][0], abs=1e-8, nan_ok=True), name
    has_own = bool(np.isfinite(found["final_connector_state"]).all())
    assert has_own == (variant == "embedded")


def test_every_column_is_there_with_its_shape_and_type():
    found = engine_of(plan_of()).compute(3, 8).outcome
    assert set(found) == set(COLUMNS)
    for name, column in COLUMNS.items():
        assert found[name].shape == (5, *column.shape)
        assert found[name].dtype == np.dtype(column.dtype)


@pytest.mark.parametrize("cut", [1, 7, 8])
def test_how_members_are_cut_changes_no_bit(cut):
    plan = plan_of(vary=VARIED["gains"] | VARIED["gravity"])
    engine = engine_of(plan)
    whole = engine.compute(0, 20).outcome
    for start in range(0, 20, cut):
        stop = min(start + cut, 20)
        part = engine.compute(start, stop).outcome
        for name, column in part.items():
            assert column.tobytes() == whole[name][start:stop].tobytes(), name


def test_members_that_leave_the_range_are_told_and_their_neighbours_are_not_touched():
    vary = {"initial.angular_velocity[1]": {"values": [1.0, 32.0, 2.0, 40.0, 3.0]}}
    data = {
        "base": paper_config("free", False, initial={"angular_velocity": [0, 0, 0]}, **SHORT),
        "vary": vary,
    }
    plan = load_plan(data)
    engine = engine_of(plan)
    found = engine.compute(0, 5).outcome
    assert engine.single_runs.indices == [1, 3]
    left, completed = STATUSES.index("range left"), STATUSES.index("completed")
    assert found["status"].tolist() == [completed, left, completed, left, completed]
    assert found["end_time"][1] < 0.2
    sound = engine_of(load_plan({**data, "vary": {next(iter(vary)): {"values": [1.0, 2.0, 3.0]}}}))
    alone = sound.compute(0, 3).outcome
    # Run ids differ, because the numbers of the members differ.
    for name in set(alone) - {"run_id"}:
        assert alone[name].tobytes() == found[name][[0, 2, 4]].tobytes(), name


def test_variants_side_by_side():
    plan = plan_of(
        vary={
            "controller.variant": {"each": {"values": ["free", "visco-elastic"]}},
            "initial.angular_velocity[0]": {"uniform": [-20, 20]},
        },
        members=6,
    )
    found = engine_of(plan).compute(2, 12).outcome
    for index in (2, 5, 6, 11):
        expected = outcome_alone(plan, index)["final_orientation"][0]
        assert found["final_orientation"][index - 2] == pytest.approx(expected, abs=1e-9)


def test_sliding_members_are_run_alone():
    gains = {"K_s": [20000.0] * 3, "surface": {"slope": 20.0}}
    base = paper_config(
        "free", False, controller={"variant": "sliding", **gains}, duration=0.02, samples=3,
        engine="heyoka",
    )  # fmt: skip
    plan = load_plan({"base": base, "vary": {"body.mass": {"values": [40.0, 41.0]}}})
    engine = engine_of(plan)
    found = engine.compute(0, 2).outcome
    assert engine.single_runs.indices == [0, 1]
    assert (found["status"] == STATUSES.index("completed")).all()


def test_members_near_the_end_of_the_range_that_do_not_leave_it_are_kept():
    base = paper_config("free", False, initial={"angular_velocity": [0, 0, 0]}, **SHORT)
    vary = {"initial.angular_velocity[1]": {"linspace": [20, 32, 97]}}
    plan = load_plan({"base": base, "vary": vary})
    engine = engine_of(plan)
    found = engine.compute(0, 97).outcome
    completed = found["status"] == STATUSES.index("completed")
    near = found["peak_orientation"][:, 1] > 1.45
    assert (completed & near).any()
    assert engine.single_runs.indices == np.flatnonzero(~completed).tolist()
    for index in np.flatnonzero(near & completed)[:3].tolist():
        expected = outcome_alone(plan, index)
        assert expected["status"][0] == STATUSES.index("completed")
        for name in ("final_orientation", "peak_orientation", "smallest_regularity"):
            assert found[name][index] == pytest.approx(expected[name][0], abs=1e-7), name


def test_a_member_that_diverges_is_told():
    plan = plan_of(vary={"initial.velocity[0]": {"values": [0.0, 1e200, 1.0]}}, members=9)
    engine = engine_of(plan)
    found = engine.compute(0, 9).outcome
    huge = plan.values(0, 9)["initial.velocity[0]"] > 1
    assert 0 < huge.sum() < 9
    assert engine.single_runs.indices == np.flatnonzero(huge).tolist()
    completed = found["status"] == STATUSES.index("completed")
    assert completed.tolist() == (~huge).tolist()


@pytest.mark.parametrize("samples", [5, 9, 21])
def test_who_leaves_the_range_between_samples_is_found(samples):
    base = paper_config(
        "free", False, initial={"angular_velocity": [0, 0, 0]}, **{**SHORT, "samples": samples}
    )
    vary = {"initial.angular_velocity[1]": {"linspace": [20, 60, 21]}}
    plan = load_plan({"base": base, "vary": vary})
    found = engine_of(plan).compute(0, 21).outcome
    expected = [outcome_alone(plan, index)["status"][0] for index in range(21)]
    assert found["status"].tolist() == expected
    assert len(set(expected)) == 2


def test_rest_energies_that_are_not_found_at_once_are_looked_for(monkeypatch):
    plan = plan_of(vary=VARIED["gains"], members=4)
    expected = engine_of(plan).compute(0, 4).outcome

    def nothing(_, parameters, last):
        count = parameters.shape[1]
        none = np.zeros(count, dtype=bool)
        return RestStatesOfMembers(np.full(count, 1e9), np.full((count, 3), 1e9), none)

    monkeypatch.setattr(ApproachedStates, "find", nothing)
    found = engine_of(plan).compute(0, 4).outcome
    assert found["lyapunov_start"] == pytest.approx(expected["lyapunov_start"], rel=1e-9)


def test_members_that_are_projected_are_run_alone():
    held = {"coordinates": "manifold", "drift_control": "projection"}
    plan = plan_of("permanent", members=2, samples=3, duration=0.02, **held)
    engine = engine_of(plan)
    found = engine.compute(0, 2).outcome
    assert engine.single_runs.indices == [0, 1]
    assert (found["status"] == STATUSES.index("completed")).all()


def test_the_step_limit_of_a_member_is_that_of_a_single_run():
    plan = plan_of(members=3, step_limit=5)
    found = engine_of(plan).compute(0, 3).outcome
    assert (found["status"] == STATUSES.index("step limit")).all()
    assert (found["steps"] == 5).all()


@pytest.mark.parametrize("samples", [2, 3, 11, 41])
def test_however_few_the_samples_those_that_leave_the_range_are_known(samples):
    # A free body that turns about its second axis alone leaves the range above a certain speed.
    spins = {f"initial.angular_velocity[{axis}]": {"uniform": [-1, 1]} for axis in (0, 2)}
    spins["initial.angular_velocity[1]"] = {"uniform": [0, 40]}
    plan = plan_of("free", members=48, vary=spins, samples=samples, rtol=1e-8)
    found = EnsembleEngine(plan, SingleRuns(plan, "heyoka")).compute(0, 48).outcome
    expected = SingleRuns(plan, "heyoka").compute(0, 48).outcome
    assert found["status"].tolist() == expected["status"].tolist()
    assert {STATUSES[code] for code in expected["status"]} == {"completed", "range left"}
    # A member that left the range approaches no rest state in it.
    left = found["status"] == STATUSES.index("range left")
    for outcome in (found, expected):
        assert np.isnan(outcome["rest_orientation"]).all(axis=1).tolist() == left.tolist()
        assert not np.isnan(outcome["energy_at_rest"]).any()
