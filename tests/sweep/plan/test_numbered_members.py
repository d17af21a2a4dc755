"""Protects the members of a plan: their number and values, and their independence of the batch."""

import itertools
import pickle
import tracemalloc
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy import stats
from support.configs import BY_VARIANT, plain

from rbstab.sweep.plan.designs import DESIGNS
from rbstab.sweep.plan.load import load_plan
from rbstab.sweep.plan.plan import MAX_MEMBERS

GRID = """\
base: visco-elastic.yaml
vary:
  body.mass: {values: [40, 50]}
  connector:
    zip:
      controller.K_c: {scale: {geomspace: [1, 4, 3]}}
      controller.L_c[0]: {linspace: [600, 800, 3]}
  initial.angular_velocity[1]: {values: [-1, 0, 1, 2]}
"""


def rows(plan, start=0, stop=None):
    """Return the members as tuples of their values."""
    values = plan.values(start, plan.members if stop is None else stop)
    return list(zip(*(column.tolist() for column in values.values()), strict=True))


def test_a_grid_is_the_product_of_its_lists_the_last_fastest(load):
    plan = load(GRID)
    keys = ["body.mass", "controller.K_c", "controller.L_c[0]", "initial.angular_velocity[1]"]
    assert list(plan.values(0, 1)) == keys
    together = [(1.0, 600.0), (2.0, 700.0), (4.0, 800.0)]
    product = itertools.product([40.0, 50.0], together, [-1.0, 0.0, 1.0, 2.0])
    assert plan.members == 24
    listed = rows(plan)
    expected = [(mass, *pair, spin) for mass, pair, spin in product]
    assert listed == [pytest.approx(row, rel=1e-15) for row in expected]
    assert plan.dimensions == {"body.mass": 2, "connector": 3, "initial.angular_velocity[1]": 4}


RANDOM = """\
base: visco-elastic.yaml
vary:
  body.mass: {uniform: [40, 50]}
  connector:
    zip:
      controller.K_c: {scale: {loguniform: [0.1, 10]}}
      controller.L_c[0]: {uniform: [0, 1]}
      controller.L_c[1]: {values: [1, 2, 3, 4]}
  initial.angular_velocity[1]: {normal: [1, 2]}
design: DESIGN
members: 500
seed: 7
"""


@pytest.mark.parametrize("design", DESIGNS)
def test_drawn_columns_follow_their_distributions(load, design):
    plan = load(RANDOM.replace("DESIGN", design))
    assert (plan.members, plan.dimensions) == (500, {"point": 500})
    values = plan.values(0, 500)
    mass, spin = (values["body.mass"] - 40) / 10, values["initial.angular_velocity[1]"]
    assert stats.kstest(mass, "uniform").pvalue > 1e-3
    assert stats.kstest(spin, stats.norm(1, 2).cdf).pvalue > 1e-3
    assert abs(np.corrcoef(mass, spin)[0, 1]) < 0.1
    # The keys of a group have one coordinate.
    u = values["controller.L_c[0]"]
    np.testing.assert_allclose(values["controller.K_c"], 0.1 * 100**u, rtol=1e-13)
    assert (values["controller.L_c[1]"] == 1 + np.floor(4 * u)).all()


EACH = """\
base: visco-elastic.yaml
vary:
  body.mass: {uniform: [40, 50]}
  controller.K_r: {each: {scale: {values: [1, 2]}}}
  damping: {each: {zip: {controller.L_r: {scale: {values: [3, 4, 5]}}}}}
  gravity[2]: {normal: [-10, 1]}
design: DESIGN
members: 20
seed: 7
"""


@pytest.mark.parametrize("design", DESIGNS)
def test_each_entry_has_every_point(load, design):
    plan = load(EACH.replace("DESIGN", design))
    assert plan.dimensions == {"controller.K_r": 2, "damping": 3, "point": 20}
    assert plan.members == 120
    values = {key: column.reshape(2, 3, 20) for key, column in plan.values(0, 120).items()}
    for key in ("body.mass", "gravity[2]"):
        assert (values[key] == values[key][0, 0]).all()
        assert len(np.unique(values[key])) == 20
    assert (values["controller.K_r"] == np.array([1.0, 2.0])[:, None, None]).all()
    assert (values["controller.L_r"] == np.array([3.0, 4.0, 5.0])[None, :, None]).all()
    alone = EACH.replace("DESIGN", design).splitlines(keepends=True)
    same = load("".join(line for line in alone if "each" not in line)).values(0, 20)
    assert (same["body.mass"] == values["body.mass"][0, 0]).all()


ALL = [GRID, *(text.replace("DESIGN", d) for text in (RANDOM, EACH) for d in DESIGNS)]


@pytest.mark.parametrize("text", ALL)
@settings(max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_values_do_not_depend_on_the_cut(load, text, data):
    plan = load(text)
    whole = plan.values(0, plan.members)
    cuts = data.draw(st.lists(st.integers(0, plan.members), max_size=5))
    ends = [0, *sorted(cuts), plan.members]
    parts = [plan.values(start, stop) for start, stop in itertools.pairwise(ends)]
    for key, column in whole.items():
        assert np.concatenate([part[key] for part in parts]).tobytes() == column.tobytes()


@pytest.mark.parametrize("text", ALL)
def test_single_columns_in_another_process(load, text):
    plan = load(text)
    sent = pickle.loads(pickle.dumps(plan))  # noqa: S301
    for key, column in plan.values(3, 17).items():
        ((name, copied),) = sent.values(3, 17, [key]).items()
        assert (name, copied.tobytes()) == (key, column.tobytes())
    assert sent.config_of(3) == plan.config_of(3)


@pytest.mark.parametrize(("start", "stop"), [(-1, 3), (3, 2), (0, 25), (25, 25)])
def test_members_that_are_not_there(load, start, stop):
    with pytest.raises(IndexError, match="of a plan with 24"):
        load(GRID).values(start, stop)


def test_no_value_is_negative_zero(load):
    values = load("base: free.yaml\nvary:\n  gravity[0]: {values: [-0.0, 0]}\n").values(0, 2)
    assert not np.signbit(values["gravity[0]"]).any()


MANY = {"body.mass": {"linspace": [1, 2, MAX_MEMBERS // 4]}, "gravity[0]": {"linspace": [0, 1, 4]}}


@pytest.mark.parametrize("design", ["grid", "random", "sobol"])
def test_the_largest_plans_need_no_memory(design):
    plan: dict[str, Any] = {"base": plain(BY_VARIANT["free"]), "vary": MANY}
    if design != "grid":
        plan |= {"design": design, "members": MAX_MEMBERS, "seed": 1}
        load_plan(plan | {"members": 4}).values(0, 4)  # what a design imports does not count
    tracemalloc.start()
    loaded = load_plan(plan)
    assert loaded.members == MAX_MEMBERS
    last = loaded.values(MAX_MEMBERS - 2, MAX_MEMBERS)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 5e6
    if design == "grid":
        assert last["body.mass"].tolist() == [2.0, 2.0]
        assert last["gravity[0]"].tolist() == pytest.approx([2 / 3, 1.0])
