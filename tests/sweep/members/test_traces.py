"""Protects the traces of members, by both engines, against the single run of each member."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.paper_runs import paper_config

import rbstab
from rbstab.config.build import problem_of
from rbstab.sweep.members.engines import factory_for
from rbstab.sweep.members.outcome import STATUSES
from rbstab.sweep.members.single import SingleRuns
from rbstab.sweep.members.traces import TRACE_QUANTITIES, checked_traces, copy_single_run, layout_of
from rbstab.sweep.plan.dump import plan_data
from rbstab.sweep.plan.load import load_plan

VARIANTS = Path(__file__).parents[3] / "configs" / "sweeps" / "variants.yaml"

SHORT: dict[str, Any] = {"duration": 0.4, "samples": 21, "rtol": 1e-11, "engine": "heyoka"}

SPIN = {"initial.angular_velocity[0]": {"linspace": [-20, 20, 21]}}


def plan_of(variant="visco-elastic", vary=None, keep="traces", **changes):
    base = paper_config(variant, True, **{**SHORT, **changes})
    return load_plan({"base": base, "vary": vary or SPIN, "keep": keep})


def ensemble(plan):
    return factory_for("heyoka")(plan)


def assert_close(traces, row, run, tolerance):
    """Assert that a trace equals a single run up to its last sample, and is NaN after it.

    Returns:
        The number of samples that the run reached.
    """
    reached = int((run["time"][: len(traces["time"])] == traces["time"][: len(run["time"])]).sum())
    for name in traces:
        if name == "time":
            continue
        if name not in run:
            assert np.isnan(traces[name][row]).all(), name
            continue
        found, expected = traces[name][row, :reached], run[name][:reached]
        size = run["lyapunov"] if name == "energy_residual" else run[name]
        scale = max(1e-3, np.abs(size[:reached]).max())
        assert found == pytest.approx(expected, abs=tolerance * scale), name
        assert np.isnan(traces[name][row, reached:]).all(), name
    return reached


@pytest.mark.parametrize("variant", ["free", "permanent", "visco-elastic", "embedded"])
def test_traces_are_single_runs(variant):
    plan = plan_of(variant)
    traces = ensemble(plan).compute(0, 21).traces
    own = {"connector_state"} if variant == "embedded" else set()
    assert set(traces) == {"time", *TRACE_QUANTITIES} - {"connector_state", "supplied_energy"} | own
    for member in (0, 20):
        run = rbstab.simulate(plan.config_of(member))
        assert assert_close(traces, member, run, 1e-11) == 21


def test_traces_are_single_runs_of_the_other_engine():
    plan = plan_of(vary={"controller.K_r": {"scale": {"values": [0.5, 1.0, 2.0]}}})
    traces = ensemble(plan).compute(0, 3).traces
    other = load_plan(
        {
            "base": paper_config("visco-elastic", True, **{**SHORT, "engine": "scipy"}),
            "vary": {"controller.K_r": {"scale": {"values": [0.5, 1.0, 2.0]}}},
        }
    )
    assert_close(traces, 2, rbstab.simulate(other.config_of(2)), 1e-8)


def test_every_member_has_its_own_forces():
    vary = {
        "controller.K_c": {"scale": {"values": [0.5, 1.0, 2.0]}},
        "controller.L_t": {"scale": {"values": [0.5, 2.0]}},
    }
    plan = plan_of(vary=vary, keep={"traces": [1, 2, 4, 5]})
    traces = ensemble(plan).compute(0, 6).traces
    for place, member in enumerate((1, 2, 4, 5)):
        run = rbstab.simulate(plan.config_of(member))
        assert_close(traces, place, run, 1e-11)


def test_single_runs_of_some_members():
    plan = plan_of(keep={"traces": {"every": 2}}, samples=3, duration=0.02)
    traces = SingleRuns(plan).compute(1, 6).traces
    for place, member in enumerate((2, 4)):
        assert_close(traces, place, rbstab.simulate(plan.config_of(member)), 0.0)


def test_a_trace_balances():
    """Check relations within a trace, without any engine or equation of the program."""
    plan = plan_of(duration=0.2, samples=2001)
    traces = ensemble(plan).compute(3, 5).traces
    times, step = traces["time"], traces["time"][1]
    for of, rate in (
        ("lyapunov", "lyapunov_rate"),
        ("lyapunov_change", "lyapunov_rate"),
        ("position", "velocity"),
        ("contact_displacement", "contact_velocity"),
    ):
        slope = (traces[of][:, 2:] - traces[of][:, :-2]) / (2 * step)
        expected = traces[rate][:, 1:-1]
        assert slope == pytest.approx(expected, abs=1e-4 * np.abs(expected).max()), of
    start = traces["lyapunov"][:, :1] + traces["lyapunov_change"]
    left = traces["lyapunov"] - start - traces["energy_residual"]
    assert left == pytest.approx(np.zeros_like(left), abs=1e-9)
    assert len(times) == 2001


def test_the_contact_force_is_that_of_the_connector():
    """The force is Λ = -K_c E - L_c F (eq. 40), with the gains of the base."""
    plan = plan_of()
    controller = plan.config_of(0).controller
    K, L = (np.diag(np.broadcast_to(g, 3)) if np.ndim(g) < 2 else np.array(g)
            for g in (controller.K_c, controller.L_c))  # fmt: skip
    traces = ensemble(plan).compute(0, 2).traces
    expected = -traces["contact_displacement"] @ K - traces["contact_velocity"] @ L
    assert traces["contact_force"] == pytest.approx(expected, rel=1e-12, abs=1e-9)


@pytest.mark.parametrize("keep", ["traces", {"traces": {"every": 3}}, {"traces": [1, 2, 9, 20]}])
def test_neither_shards_nor_the_choice_of_members_show(keep):
    vary = {"initial.angular_velocity[1]": {"linspace": [0, 40, 21]}}
    everyone = ensemble(plan_of(vary=vary)).compute(0, 21).traces
    plan = plan_of(vary=vary, keep=keep)
    engine = ensemble(plan)
    chosen = np.flatnonzero(plan.keep.selected(0, 21))
    for size in (21, 5, 1):
        parts = [engine.compute(a, min(a + size, 21)).traces for a in range(0, 21, size)]
        parts = [part for part in parts if part is not None]
        for name in everyone:
            if name != "time":
                joined = np.concatenate([part[name] for part in parts])
                assert joined.tobytes() == everyone[name][chosen].tobytes(), name


def test_members_that_are_not_chosen_cost_nothing():
    assert ensemble(plan_of(keep="summary")).compute(0, 3).traces is None
    plan = plan_of(keep={"traces": {"every": 20}})
    assert ensemble(plan).compute(1, 20).traces is None
    assert SingleRuns(plan).compute(1, 3).traces is None
    assert ensemble(plan).variant_engines["visco-elastic"].forces is not None
    assert ensemble(plan_of(keep="summary")).variant_engines["visco-elastic"].forces is None


def test_what_follows_of_a_trace_is_the_summary():
    plan = plan_of()
    outcome, traces = ensemble(plan).compute(0, 21)
    assert (outcome["lyapunov_end"] == traces["lyapunov"][:, -1]).all()
    assert (outcome["final_orientation"] == traces["orientation"][:, -1]).all()
    # It is the largest at the ends of steps, and samples lie between them.
    largest = np.abs(traces["energy_residual"]).max(axis=1)
    assert outcome["energy_residual"] == pytest.approx(largest, rel=0.5)
    without = ensemble(plan_of(keep="summary")).compute(0, 21).outcome
    for name, column in without.items():
        assert column.tobytes() == outcome[name].tobytes(), name


def test_members_that_leave_the_range():
    vary = {"initial.angular_velocity[1]": {"values": [1.0, 32.0, 2.0, 40.0, 3.0]}}
    base = paper_config("free", False, initial={"angular_velocity": [0, 0, 0]}, **SHORT)
    plan = load_plan({"base": base, "vary": vary, "keep": "traces"})
    outcome, traces = ensemble(plan).compute(0, 5)
    for member in range(5):
        run = rbstab.simulate(plan.config_of(member))
        reached = assert_close(traces, member, run, 1e-11)
        left = STATUSES[outcome["status"][member]] == "range left"
        assert left == (member in (1, 3))
        # The state at the stop is not a sample.
        assert reached == len(run["time"]) - left


def test_members_that_diverge():
    plan = plan_of(vary={"initial.velocity[0]": {"values": [0.0, 1e200]}})
    outcome, traces = ensemble(plan).compute(0, 2)
    assert STATUSES[outcome["status"][1]] == "diverged"
    assert np.isfinite(traces["position"][0]).all()
    assert np.isnan(traces["position"][1, 1:]).all()
    assert traces["velocity"][1, 0, 0] == 1e200


def test_members_that_slide():
    gains = {"K_s": [20000.0] * 3, "surface": {"slope": 20.0}}
    integration: dict[str, Any] = {**SHORT, "duration": 0.02, "samples": 5}
    base = paper_config("free", controller={"variant": "sliding", **gains}, **integration)
    vary = {"body.mass": {"values": [40.0, 41.0]}}
    plan = load_plan({"base": base, "vary": vary, "keep": "traces"})
    traces = ensemble(plan).compute(0, 2).traces
    for member in (0, 1):
        run = rbstab.simulate(plan.config_of(member))
        assert assert_close(traces, member, run, 0.0) == 5
        assert (traces["contact_force"][member] == run["contact_force"]).all()


def test_variants_side_by_side():
    short = ("integration.duration=0.1", "integration.samples=11", "integration.rtol=1e-11")
    keep = {"traces": [1, 2998, 2999, 3000, 4999]}
    plan = load_plan(plan_data(load_plan(VARIANTS, short)) | {"keep": keep})
    traces = ensemble(plan).compute(2999, 3004).traces
    assert len(traces["lyapunov"]) == 2
    for place, member in enumerate((2999, 3000)):
        assert_close(traces, place, rbstab.simulate(plan.config_of(member)), 1e-11)
    assert np.isnan(traces["connector_state"][0]).all()
    assert np.isfinite(traces["connector_state"][1]).all()


def test_a_member_that_cannot_be_followed_has_a_trace_of_nothing(monkeypatch):
    plan = plan_of()

    def failing(config):
        if config.title == plan.config_of(1).title:
            raise ZeroDivisionError
        return problem_of(config)

    monkeypatch.setattr("rbstab.sweep.members.single.problem_of", failing)
    traces = SingleRuns(plan).compute(0, 2).traces
    assert traces is not None
    assert np.isnan(traces["lyapunov"][1]).all()
    assert np.isfinite(traces["lyapunov"][0]).all()


def test_a_stop_at_a_sample_is_one_sample():
    layout = layout_of(plan_of())
    blank = layout.empty(1)
    times = np.array([*layout.times[:3], layout.times[2]])
    value = np.arange(4.0)
    copy_single_run(blank, 0, {"time": times, "lyapunov": value})
    assert blank["lyapunov"][0, :3].tolist() == [0.0, 1.0, 2.0]
    assert np.isnan(blank["lyapunov"][0, 3:]).all()


def test_traces_that_an_engine_owes_are_missed():
    plan = plan_of()
    traces = ensemble(plan).compute(0, 2).traces
    found = checked_traces(traces, plan, 0, 2)
    assert found is not None
    assert found["lyapunov"].dtype == np.float64
    for wrong in (None, {}, {**traces, "velocity": traces["velocity"][:1]}):
        with pytest.raises(ValueError, match="for 2 traces"):
            checked_traces(wrong, plan, 0, 2)
    assert checked_traces(None, plan_of(keep="summary"), 0, 2) is None


def test_the_size_of_a_trace():
    layout = layout_of(plan_of("embedded"))
    assert layout.size == sum(data[0].nbytes for n, data in layout.empty(1).items() if n != "time")
    assert layout.size == 8 * 21 * (8 * 3 + 4)
