"""Protects sweeps of inputs: batches with time, seeds that count members, and their identities."""

import numpy as np
import pytest
from support.inputs import LEGS, SINE, couple, driven, force

from rbstab.config.errors import ConfigError
from rbstab.config.load import run_id
from rbstab.experiment.answers.run_answer import answer_of
from rbstab.experiment.simulate import simulate
from rbstab.experiment.summary import settling_time_of
from rbstab.sweep.members.ensemble import EnsembleEngine
from rbstab.sweep.members.single import SingleRuns
from rbstab.sweep.members.traces import layout_of
from rbstab.sweep.plan.load import load_plan

CONTROLLER = {
    "variant": "visco-elastic",
    **{name: [30.0, 40.0, 50.0] for name in ("K_t", "K_r", "K_c")},
    **{name: [3.0, 4.0, 5.0] for name in ("L_t", "L_r", "L_c")},
}
SMOOTH = {"push": force(SINE, point=[0.1, 0, 0.2]), "turn": couple({"kind": "constant"})}
NOISY = {"gust": couple(LEGS["noise"])}


def plan_of(vary, elements=SMOOTH, **sections):
    base = driven(elements, "heyoka", controller=CONTROLLER, integration={"samples": 33})
    return load_plan({"base": base, "vary": vary} | sections)


class NoSingleRuns:
    def compute(self, start, stop):
        raise AssertionError("a smooth member was not integrated in a batch")


FREQUENCY, AMPLITUDE = "elements.push.signal.frequency", "elements.push.amplitude"
VARY = {AMPLITUDE: {"values": [1e-4, 3.0, 30.0]}, FREQUENCY: {"linspace": [0.5, 9.0, 5]}}


@pytest.mark.heavy
def test_smooth_members_in_batches_are_their_single_runs():
    """Also their peaks, found again within one interval, which begins at a time of its own."""
    plan = plan_of(VARY, keep="traces")
    shard = EnsembleEngine(plan, NoSingleRuns()).compute(0, plan.members)
    single = SingleRuns(plan, "heyoka").compute(0, plan.members)
    for name in ("final_orientation", "final_velocity", "peak_orientation", "lyapunov_end"):
        ours, theirs = shard.outcome[name], single.outcome[name]
        np.testing.assert_allclose(ours, theirs, rtol=1e-8, atol=1e-11)
    assert np.ptp(shard.outcome["peak_orientation"]) > 1e-3
    assert shard.traces is not None
    assert single.traces is not None
    for name in (
        "orientation",
        "contact_force",
        "lyapunov_rate",
        "lyapunov_change",
        "supplied_energy",
    ):
        size = np.abs(single.traces[name]).max()
        np.testing.assert_allclose(shard.traces[name], single.traces[name], atol=1e-10 * size)
    sizes = np.abs(shard.outcome["lyapunov_end"]) + np.abs(shard.outcome["lyapunov_start"])
    assert (shard.outcome["energy_residual"] < 1e-11 * (sizes + 1e-12)).all()
    assert list(shard.outcome["run_id"]) == [
        run_id(plan.config_of(k)).encode() for k in range(plan.members)
    ]


@pytest.mark.heavy
def test_the_bits_of_a_member_do_not_depend_on_the_others():
    """Some members need another energy scale and are integrated twice, others are not."""
    plan = plan_of(VARY)
    engine = EnsembleEngine(plan, NoSingleRuns())
    together = engine.compute(0, plan.members).outcome
    for member in (0, 7, 14):
        alone = EnsembleEngine(plan, NoSingleRuns()).compute(member, member + 1).outcome
        for name, column in alone.items():
            np.testing.assert_array_equal(column[0], together[name][member])


@pytest.mark.heavy
def test_each_member_has_its_own_noise():
    seed = "elements.gust.signal.seed"
    plan = plan_of({seed: {"member": [5]}}, NOISY, design="random", members=4, seed=1)
    assert plan.members == 4
    assert [plan.config_of(k).elements["gust"].signal.seed for k in range(4)] == [5, 6, 7, 8]
    shard = EnsembleEngine(plan, SingleRuns(plan, "heyoka")).compute(0, 4)
    ends = shard.outcome["final_orientation"]
    assert len(np.unique(ends[:, 2])) == 4
    run = simulate(plan.config_of(2))
    np.testing.assert_array_equal(run["orientation"][-1], ends[2])
    assert shard.outcome["run_id"][2].decode() == run.attributes["run_id"]


def test_conditions_have_the_same_noises():
    """Beside `each` a seed counts points; in a grid it counts members."""
    seed, size = "elements.gust.signal.seed", "elements.gust.amplitude"
    design = {"design": "random", "members": 3, "seed": 1}
    each = plan_of({size: {"each": {"values": [1, 2]}}, seed: {"member": [0]}}, NOISY, **design)
    assert each.values(0, 6)[seed].tolist() == [0, 1, 2, 0, 1, 2]
    assert each.values(2, 5)[seed].tolist() == [2, 0, 1]
    grid = plan_of({size: {"values": [1, 2]}, seed: {"member": [4]}}, NOISY)
    assert grid.members == 2
    assert grid.values(0, 2)[seed].tolist() == [4, 5]
    drawn = plan_of({size: {"uniform": [1, 2]}, seed: {"member": [0]}}, NOISY, **design)
    alone = plan_of({size: {"uniform": [1, 2]}}, NOISY, **design)
    np.testing.assert_array_equal(drawn.values(0, 3)[size], alone.values(0, 3)[size])


WRONG = {
    "uniform": (
        {"elements.gust.signal.seed": {"uniform": [0, 9]}},
        "vary.elements.gust.signal.seed: is a seed (expected {member: [first]}, or a list of "
        "whole numbers)",
    ),
    "halves": (
        {"elements.gust.signal.seed": {"values": [1, 1.5]}},
        "is a seed (expected {member: [first]}, or a list of whole numbers)",
    ),
    "no seed": (
        {"elements.gust.amplitude": {"member": [0]}},
        "vary.elements.gust.amplitude: is no seed (expected the seed of a noise for {member: "
        "[first]})",
    ),
    "each": (
        {"elements.gust.signal.seed": {"each": {"member": [0]}}},
        "vary.elements.gust.signal.seed.each.member: is unknown (expected one of values,",
    ),
    "no list": (
        {"elements.gust.signal.seed": {"member": 3}},
        "member: is 3 (expected [first])",
    ),
}


@pytest.mark.parametrize("case", WRONG)
def test_wrong_seeds(case):
    vary, words = WRONG[case]
    with pytest.raises(ConfigError) as caught:
        plan_of(vary, NOISY, design="random", members=4, seed=1)
    assert words in str(caught.value)


def test_traces_have_the_supplied_energy_only_with_inputs():
    """It closes the balance of v with what is dissipated; passive members have no such quantity."""
    assert "supplied_energy" in layout_of(plan_of(VARY, keep="traces")).names
    passive = plan_of({"body.mass": {"values": [1.0, 2.0]}}, {}, keep="traces")
    assert "supplied_energy" not in layout_of(passive).names


def test_a_member_at_rest_that_is_pushed_has_a_settling_time():
    """Its v(0) is zero, so it is compared with its largest v; a single run finds the same time."""
    elements = {"push": force(LEGS["pulse"], point=[0.1, 0, 0.2])}
    vary = {AMPLITUDE: {"values": [3.0, 6.0]}}
    base = driven(elements, "scipy", controller=CONTROLLER, integration={"samples": 400})
    base["integration"]["duration"] = 40.0
    base["initial"] = {}
    plan = load_plan({"base": base, "vary": vary})
    found = SingleRuns(plan, "scipy").compute(0, 2).outcome
    assert np.abs(found["lyapunov_start"]).max() < 1e-12
    for k in range(2):
        result = simulate(plan.config_of(k))
        v, times = result["lyapunov"], result["time"]
        late = times > found["settling_time"][k]
        assert 0 < late.sum() < len(times)
        assert (v[late] < 1e-3 * v.max()).all()
        assert v[~late][-1] >= 1e-3 * v.max()
        assert settling_time_of(result) == found["settling_time"][k]
        text = str(answer_of(result).this_start)
        assert "v stays below 0.001 of its largest value from t = " in text
