"""Protects sweeps of inputs: batches with time, seeds that count members, and their identities."""

import numpy as np
import pytest
from support.inputs import LEGS, driven, force
from support.member_plans import AMPLITUDE, CONTROLLER, NOISY, with_inputs

from rbstab.config.errors import ConfigError
from rbstab.experiment.answers.run_answer import answer_of
from rbstab.experiment.simulate import simulate
from rbstab.experiment.summary import settling_time_of
from rbstab.sweep.members.single import SingleRuns
from rbstab.sweep.plan.load import load_plan


def test_conditions_have_the_same_noises():
    """Beside `each` a seed counts points; in a grid it counts members."""
    seed, size = "elements.gust.signal.seed", "elements.gust.amplitude"
    design = {"design": "random", "members": 3, "seed": 1}
    each = with_inputs(NOISY, {size: {"each": {"values": [1, 2]}}, seed: {"member": [0]}}, **design)
    assert each.values(0, 6)[seed].tolist() == [0, 1, 2, 0, 1, 2]
    assert each.values(2, 5)[seed].tolist() == [2, 0, 1]
    grid = with_inputs(NOISY, {size: {"values": [1, 2]}, seed: {"member": [4]}})
    assert grid.members == 2
    assert grid.values(0, 2)[seed].tolist() == [4, 5]
    assert [grid.config_of(k).elements["gust"].signal.seed for k in range(2)] == [4, 5]
    drawn = with_inputs(NOISY, {size: {"uniform": [1, 2]}, seed: {"member": [0]}}, **design)
    alone = with_inputs(NOISY, {size: {"uniform": [1, 2]}}, **design)
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
        with_inputs(NOISY, vary, design="random", members=4, seed=1)
    assert words in str(caught.value)


def test_a_member_at_rest_that_is_pushed_has_a_settling_time():
    """Its v(0) is zero, so it is compared with its largest v; a single run finds the same time."""
    elements = {"push": force(LEGS["pulse"], point=[0.1, 0, 0.2])}
    vary = {AMPLITUDE: {"values": [3.0, 6.0]}}
    base = driven(elements, "scipy", controller=CONTROLLER, integration={"samples": 400})
    base["integration"]["duration"] = 40.0
    base["initial"] = {}
    plan = load_plan({"base": base, "vary": vary})
    outcome = SingleRuns(plan, "scipy").compute(0, 2).outcome
    assert np.abs(outcome["lyapunov_start"]).max() < 1e-12
    for k in range(2):
        result = simulate(plan.config_of(k))
        v, times = result["lyapunov"], result["time"]
        late = times > outcome["settling_time"][k]
        assert 0 < late.sum() < len(times)
        assert (v[late] < 1e-3 * v.max()).all()
        assert v[~late][-1] >= 1e-3 * v.max()
        assert settling_time_of(result) == outcome["settling_time"][k]
        text = str(answer_of(result).this_start)
        assert "v stays below 0.001 of its largest value from t = " in text
