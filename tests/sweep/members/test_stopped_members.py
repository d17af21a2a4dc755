"""Protects members with a stop: single runs of either engine, with the exact peak of θ2."""

import numpy as np
import pytest
from support.stops import stop
from support.switching import ENGINES, data

from rbstab.experiment.simulate import simulate
from rbstab.sweep.members.engines import factory_for
from rbstab.sweep.members.outcome import STATUSES
from rbstab.sweep.plan.load import load_plan

RESTITUTIONS = [0.0, 0.4, 0.8]


def plan_of(engine_name):
    controller = {"variant": "permanent", "K_t": [40.0] * 3, "L_t": [9.0] * 3}
    controller |= {"K_r": [9.0] * 3, "L_r": [3.0] * 3}
    base = data(
        {"end": stop()},
        {"angular_velocity": [0.5, 1.0, -0.3]},
        {"duration": 4.0, "samples": 41, "engine": engine_name},
        controller=controller,
        gravity=[0.0, 0.0, -9.81],
    )
    base["body"] |= {"contact_point": [-0.8, 0.1, -0.2]}
    vary = {"elements.end.restitution": {"values": RESTITUTIONS}}
    return load_plan({"base": base, "vary": vary})


@pytest.mark.parametrize("engine_name", ENGINES)
def test_each_member_is_its_single_run(engine_name):
    plan = plan_of(engine_name)
    factory = factory_for(engine_name)
    found = factory(plan).compute(0, 3).outcome
    for member in range(3):
        run = simulate(plan.config_of(member))
        assert STATUSES[found["status"][member]] == run.status == "completed"
        assert found["steps"][member] == run.attributes["steps"]
        assert (found["final_orientation"][member] == run["orientation"][-1]).all()
        residual = np.abs(run["energy_residual"]).max()
        assert found["energy_residual"][member] == residual < 1e-8
        assert run["impact_count"][-1] > 0
    assert (found["peak_orientation"][:, 1] == 0.3).all()
    assert np.isfinite(found["peak_orientation_error"]).all()
    # A part of the members alone has the same bits.
    again = factory(plan).compute(1, 3).outcome
    for name, values in again.items():
        np.testing.assert_array_equal(values, found[name][1:], err_msg=name)


def test_a_plan_with_a_start_beyond_the_stop_is_refused():
    from rbstab.config.errors import ConfigError

    plan = plan_of("scipy")
    base = plan.config_of(0).model_dump(mode="json", exclude_none=True)
    vary = {"initial.orientation[1]": {"values": [0.2, 0.4]}}
    with pytest.raises(ConfigError, match=r"\|θ2\| = 0.4 rad, beyond the stop end"):
        load_plan({"base": base, "vary": vary})
