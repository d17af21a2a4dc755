"""Protects the form of the traces of members: their layout, and what is refused."""

import numpy as np
import pytest
from support.member_plans import PLANS, paper

from rbstab.sweep.members.traces import copy_single_run, layout_of
from rbstab.sweep.plan.load import load_plan

VARY = {"initial.angular_velocity[0]": {"linspace": [-20, 20, 21]}}

VECTORS = (
    *("orientation", "angular_velocity", "position", "velocity"),
    *("contact_displacement", "contact_velocity", "contact_force"),
)
NUMBERS = ("lyapunov", "lyapunov_rate", "lyapunov_change", "energy_residual")


def plan_of(variant="visco-elastic", keep="traces"):
    base = paper(variant, samples=5, duration=0.02)
    return load_plan({"base": base, "vary": VARY, "keep": keep})


@pytest.mark.parametrize(
    ("name", "extra"),
    [
        ("free", set()),
        ("permanent", set()),
        ("embedded", {"connector_state"}),
        ("variants", {"connector_state"}),
        ("inputs", {"supplied_energy"}),
    ],
)
def test_a_trace_has_what_its_variants_have(name, extra):
    layout = layout_of(PLANS[name][0]())
    assert set(layout.quantities) == {*VECTORS, *NUMBERS} | extra
    assert layout.size == sum(
        data[0].nbytes for quantity, data in layout.empty(1).items() if quantity != "time"
    )
    vectors = len(VECTORS) + ("connector_state" in extra)
    numbers = len(layout.quantities) - vectors
    assert layout.size == 8 * len(layout.times) * (3 * vectors + numbers)


def test_a_stop_at_a_sample_is_one_sample():
    layout = layout_of(plan_of())
    blank = layout.empty(1)
    times = np.array([*layout.times[:3], layout.times[2]])
    copy_single_run(blank, 0, {"time": times, "lyapunov": np.arange(4.0)})
    assert blank["lyapunov"][0, :3].tolist() == [0.0, 1.0, 2.0]
    assert np.isnan(blank["lyapunov"][0, 3:]).all()
