"""Members of every kind: their bits depend on the plan alone, and each is its own single run."""

import json
import threading
from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.member_plans import (
    PITCH,
    PITCHING,
    PLANS,
    SLOPE,
    SPIN,
    TURNS,
    RecordedSingleRuns,
    drawn,
    keeping,
    listed,
    paper,
    turning,
)

from rbstab.experiment.simulate import simulate
from rbstab.integrate.status import RunStatus
from rbstab.sweep.folder.scipy_comparison import compare
from rbstab.sweep.members.approached_states import ApproachedStates, RestStatesOfMembers
from rbstab.sweep.members.engine import columns_of_failed
from rbstab.sweep.members.engines import factory_for
from rbstab.sweep.members.ensemble import EnsembleEngine
from rbstab.sweep.members.outcome import STATUSES, outcome_columns
from rbstab.sweep.members.single import SingleRuns
from rbstab.sweep.plan.load import load_plan

COMPLETED, LEFT = STATUSES.index("completed"), STATUSES.index("range left")

slow = pytest.mark.slow

each_plan = pytest.mark.parametrize("name", PLANS)


@cache
def made(name):
    """Return a plan, its engine, and all its members with their motions, computed at once."""
    plan = keeping(PLANS[name][0](), 1)
    engine = EnsembleEngine(plan, RecordedSingleRuns(plan))
    return plan, engine, engine.compute(0, plan.members)


def batches(plan):
    return factory_for("heyoka")(plan)


def alone(plan, *arguments, **options):
    return SingleRuns(plan, *arguments, **options)


def in_thread(compute, *bounds):
    """Return what an engine computes in a thread of its own."""
    results = []
    thread = threading.Thread(target=lambda: results.append(compute(*bounds)))
    thread.start()
    thread.join(120.0)
    return results[0]


# Bits


@each_plan
@settings(max_examples=4, deadline=None)
@given(choices=st.data())
def test_no_bit_depends_on_division_order_kept_motions_threads_or_what_was_computed_before(
    name, choices
):
    plan, engine, whole = made(name)
    every = choices.draw(st.integers(0, 3))
    if every != 1:
        plan = keeping(plan, every)
        engine = batches(plan)
    cuts = choices.draw(st.sets(st.integers(1, plan.members - 1), max_size=3))
    bounds = list(zip([0, *sorted(cuts)], [*sorted(cuts), plan.members], strict=True))
    for start, stop in choices.draw(st.permutations(bounds)):
        threaded = choices.draw(st.booleans())
        part = in_thread(engine.compute, start, stop) if threaded else engine.compute(start, stop)
        for column, values in part.outcome.items():
            assert values.tobytes() == whole.outcome[column][start:stop].tobytes(), column
        rows = start + np.flatnonzero(plan.keep.selected(start, stop))
        assert (part.traces is None) == (not len(rows))
        for quantity, values in (part.traces or {}).items():
            if quantity != "time":
                assert values.tobytes() == whole.traces[quantity][rows].tobytes(), quantity


def test_a_single_member_of_many_parts_has_the_bits_that_it_has_among_others():
    """numpy sums eight and more numbers in another order where they are alone in memory."""
    plan, engine, whole = made("elements")
    for member in range(plan.members):
        alone = engine.compute(member, member + 1)
        for column, values in alone.outcome.items():
            assert values.tobytes() == whole.outcome[column][[member]].tobytes(), column


def test_a_member_that_fails_alone_changes_no_bit_of_its_neighbours():
    """A large K_s chatters: the others have less than a tenth of its switches."""
    controller = SLOPE | {"surface": "position", "K_s": [2000.0] * 3, "switch_limit": 100}
    base = paper("free", False, controller=controller, duration=0.1, samples=5)
    key = "controller.K_s[1]"
    with_strong = listed(base, **{key: [500.0, 200_000.0, 700.0]})
    batch, expected = (
        batches(plan).compute(0, plan.members).outcome
        for plan in (with_strong, listed(base, **{key: [500.0, 700.0]}))
    )
    ends = [STATUSES[code] for code in batch["status"]]
    assert ends == [RunStatus.COMPLETED, RunStatus.SWITCH_LIMIT, RunStatus.COMPLETED]
    assert 0 < batch["end_time"][1] < 0.1
    for name, column in expected.items():
        assert column.tobytes() == batch[name][[0, 2]].tobytes(), name


@pytest.mark.parametrize("name", ["recorded", "extremes_of", "outcome_of"])
def test_a_member_without_columns_is_not_completed(monkeypatch, name):
    """A completed motion of which nothing can be said has failed; an early end stays what it is."""
    plan = drawn(paper("free", engine="scipy", duration=0.05), SPIN, 2)
    engine = SingleRuns(plan)
    assert engine.compute(0, 2).outcome["status"].tolist() == [COMPLETED] * 2

    def refuse(*_, **__):
        raise MemoryError

    monkeypatch.setattr(f"rbstab.sweep.members.single.{name}", refuse)
    outcome = engine.compute(0, 2).outcome
    assert outcome["status"].tolist() == [STATUSES.index("solver failure")] * 2
    assert np.isnan(outcome["end_time"]).all()


def test_a_member_whose_preparation_fails_fails_alone(monkeypatch):
    from rbstab.config.build import problem_of

    plan = listed(paper("free", engine="scipy", duration=0.02), **{"body.mass": [40.0, 45.0, 50.0]})
    plan = keeping(plan, 1)
    before = alone(plan).compute(0, 3)

    def failing(config):
        if config.body.mass == 45.0:
            raise ZeroDivisionError
        return problem_of(config)

    monkeypatch.setattr("rbstab.sweep.members.single.problem_of", failing)
    after = alone(plan).compute(0, 3)
    for name, column in columns_of_failed(1).items():
        assert after.outcome[name][[0, 2]].tobytes() == before.outcome[name][[0, 2]].tobytes()
        assert after.outcome[name][1:2].tobytes() == column.tobytes(), name
    assert np.isnan(after.traces["lyapunov"][1]).all()
    assert after.traces["lyapunov"][0].tobytes() == before.traces["lyapunov"][0].tobytes()


# Values


LOOSER = {
    # The largest at the ends of steps, and of samples.
    "energy_residual": 1e-8,
    "energy_scale": 0.05,
    # Where a slope is zero, and at the end of a descent.
    "peak_time": 1e-6,
    "rest_orientation": 1e-6,
    # Near θ2 = ±90°.
    "peak_orientation": 1e-6,
    "peak_tilt": 1e-6,
    "smallest_regularity": 1e-4,
}
"""Bounds of the differences of columns that are no state, for other reasons than the tolerance."""


@each_plan
def test_each_member_is_its_single_run(name):
    """Columns and motions; those that run alone to the last bit, and only the expected ones do."""
    plan, engine, whole = made(name)
    columns = outcome_columns(plan)
    assert whole.outcome.keys() == columns.keys()
    for column, declared in columns.items():
        assert whole.outcome[column].shape == (plan.members, *declared.shape)
        assert whole.outcome[column].dtype == np.dtype(declared.dtype)
    single = alone(plan, "heyoka", with_largest=True)
    assert engine.single_runs.members == PLANS[name][1]
    for member in sorted({0, 1, plan.members // 2, plan.members - 1}):
        expected = single.compute(member, member + 1)
        batch = {column: values[[member]] for column, values in whole.outcome.items()}
        unlike, differences = compare(batch, expected.outcome)
        assert unlike == 0
        is_alone = member in PLANS[name][1]
        for column, difference in differences.items():
            assert difference <= (0.0 if is_alone else LOOSER.get(column, 1e-8)), column
        for quantity, values in expected.traces.items():
            samples = whole.traces[quantity][[member]] if quantity != "time" else values
            of_size = expected.traces["lyapunov" if "residual" in quantity else quantity]
            size = 0.0 if is_alone else max(1e-3, np.nanmax(np.abs(of_size), initial=0.0))
            np.testing.assert_allclose(
                samples, values, rtol=0.0, atol=1e-8 * size, err_msg=quantity
            )


@pytest.mark.parametrize("name", ["visco-elastic", "embedded", "elements", "inputs", "switching"])
def test_the_engines_find_the_same_members(name):
    plan, _, whole = made(name)
    theirs = alone(plan, "scipy", with_largest=True).compute(0, 3).outcome
    unlike, differences = compare({k: v[:3] for k, v in whole.outcome.items()}, theirs)
    assert unlike == 0
    for column, difference in differences.items():
        assert difference <= max(1e-7, LOOSER.get(column, 0.0)), column


@pytest.mark.parametrize(
    ("name", "member"),
    [("variants", 7), ("noise", 2), ("switching", 1), ("stopped", 1), ("sliding", 0),
     ("range left", 3)],
)  # fmt: skip
def test_a_single_run_is_the_run_of_its_config(name, member):
    plan, _, _ = made(name)
    outcome, traces = alone(plan, "heyoka").compute(member, member + 1)
    run = simulate(plan.config_of(member))
    row = {column: values[0] for column, values in outcome.items()}
    assert STATUSES[row["status"]] == run.status
    assert row["steps"] == run.attributes["steps"]
    assert row["end_time"] == run["time"][-1]
    for quantity in ("orientation", "angular_velocity", "position", "velocity"):
        assert (row[f"final_{quantity}"] == run[quantity][-1]).all()
    connector_state = run["connector_state"][-1] if "connector_state" in run else np.full(3, np.nan)
    assert np.array_equal(row["final_connector_state"], connector_state, equal_nan=True)
    assert row["lyapunov_start"] == run["lyapunov"][0]
    assert row["lyapunov_end"] == run["lyapunov"][-1]
    assert row["energy_residual"] == np.abs(run["energy_residual"]).max()
    assert (row["peak_contact_displacement"] == run["peak_contact_displacement"]).all()
    assert row["peak_orientation"][1] == run["largest_pitch"]
    reached = int((run["time"] == traces["time"][: len(run["time"])]).sum())
    # The state at which a run stops early is no sample.
    assert reached == len(run["time"]) - (row["status"] == LEFT)
    for quantity in traces.keys() & set(run.variables) - {"time"}:
        assert (traces[quantity][0, :reached] == run[quantity][:reached]).all(), quantity
        assert np.isnan(traces[quantity][0, reached:]).all(), quantity


def test_quaternions_change_nothing_where_angles_suffice():
    """And they finish where angles end; the members make several turns."""
    _, _, whole = made("quaternion")
    plan = turning("Z")
    in_angles = EnsembleEngine(plan, SingleRuns(plan, "heyoka", with_largest=True))
    theirs = alone(plan, "heyoka", with_largest=True).compute(0, len(TURNS)).outcome
    same = np.flatnonzero(theirs["status"] == COMPLETED)
    assert len(same) >= 4
    unlike, differences = compare(
        *({k: v[same] for k, v in outcome.items()} for outcome in (whole.outcome, theirs))
    )
    assert unlike == 0
    assert np.pi - whole.outcome["peak_tilt"][same].max() < 1e-3
    # Near π it is π - 2√(1 - s): the root of a difference.
    assert differences.pop("peak_tilt") < 1e-5
    assert max(differences.values()) < 1e-6, differences
    assert in_angles.compute(0, 6).outcome["status"].tolist() == theirs["status"].tolist()
    assert (whole.outcome["status"] == COMPLETED).all()
    assert np.abs(whole.outcome["final_orientation"]).max() > 3 * np.pi


@pytest.mark.parametrize("samples", [2, 5, 41])
def test_who_leaves_the_range_is_known_however_few_the_samples(samples):
    base = PITCHING | {"integration": PITCHING["integration"] | {"samples": samples}}
    plan = listed(base, **{PITCH: np.linspace(20, 60, 21).tolist()})
    engine: Any = EnsembleEngine(plan, RecordedSingleRuns(plan))
    batch = engine.compute(0, 21).outcome
    expected = alone(plan, "heyoka").compute(0, 21).outcome
    assert batch["status"].tolist() == expected["status"].tolist()
    left = batch["status"] == LEFT
    assert engine.single_runs.members == set(np.flatnonzero(left).tolist())
    # Some come near the end of the range, and turn back.
    near = batch["peak_orientation"][:, 1] > 1.4
    assert (near & ~left).any()
    assert left.any()
    # A member that left the range approaches no rest state in it.
    assert np.isnan(batch["rest_orientation"]).all(axis=1).tolist() == left.tolist()
    assert not np.isnan(batch["energy_at_rest"]).any()


def test_rest_energies_that_are_not_found_at_once_are_looked_for(monkeypatch):
    plan, _, whole = made("visco-elastic")

    def nothing(_, parameters, last):
        count = parameters.shape[1]
        none = np.zeros(count, dtype=bool)
        return RestStatesOfMembers(np.full(count, 1e9), np.full((count, 3), 1e9), none, none)

    monkeypatch.setattr(ApproachedStates, "find", nothing)
    batch = batches(plan).compute(0, 4).outcome
    assert batch["lyapunov_start"] == pytest.approx(whole.outcome["lyapunov_start"][:4], rel=1e-9)


def test_each_member_has_the_rest_state_of_its_own_system():
    """Single runs of the same system share the rest state next to the unloaded position."""
    base = paper("free", False, controller=SLOPE, duration=0.05) | {"gravity": [0.0, 0.0, -10.0]}
    plan = listed(base, **{PITCH: [5.0, 20.0], "body.mass": [40.0, 40.0, 42.0]})
    energies = batches(plan).compute(0, plan.members).outcome["energy_at_rest"]
    runs = [simulate(plan.config_of(member)) for member in range(plan.members)]
    assert energies.tolist() == [float(run["energy_at_rest"]) for run in runs]
    assert energies[0] == energies[1] == energies[3] != energies[2]


@pytest.mark.parametrize("surface", [{"slope": 20}, pytest.param("position", marks=slow)])
def test_a_motion_that_slides_settles_when_its_own_energy_does(surface):
    example = "configs/examples/sliding/slope_exact_20000.yaml"
    vary = {"initial.angular_velocity[2]": {"values": [-16, -15]}}
    changes = ["integration.engine=heyoka", "integration.samples=201"]
    surface_change = f"controller.surface={json.dumps(surface)}"
    plan = load_plan({"base": example, "vary": vary}, [*changes, surface_change])
    run = simulate(plan.config_of(0))
    # On s = F + κE the work ε of the contact force replaces the energy of the connector.
    held = np.array([part != "connector" or surface == "position" for part in run["part"]])
    v = run["energy"][:, held].sum(axis=1) - run["energy_at_rest"]
    assert (run["lyapunov"][-1] < 1e-3 * v[0]) == (surface == "position")
    settled = alone(plan).compute(0, 1).outcome["settling_time"][0]
    after = run["time"] > settled
    assert (v[after] < 1e-3 * v[0]).all()
    assert v[~after][-1] >= 1e-3 * v[0]
