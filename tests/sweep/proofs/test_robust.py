"""Members whose body lies inside the box of a stored proof for all bodies within tolerances."""

from typing import Any

import numpy as np
import pytest
from support.config_elements import TIE, config_data
from support.paper_runs import paper_config
from support.sweeping import run_sweep
from sweep.proofs.plans import SHORT, SPIN

import rbstab
from rbstab.config.tolerances import tolerances_of
from rbstab.experiment.robust.bodies import bodies_for
from rbstab.sweep.members.engines import factory_for
from rbstab.sweep.plan.load import load_plan
from rbstab.sweep.proofs import robust
from rbstab.sweep.proofs.robust import START_COLUMNS, BoxProofs


@pytest.fixture(scope="module")
def sweep(tmp_path_factory):
    """A sweep of bodies and spins beside a proof for gains within 10 %, and its level."""
    folder = tmp_path_factory.mktemp("robust")
    base = paper_config("permanent", initial={"angular_velocity": [0, 0, 0]}, **SHORT)
    config = rbstab.load_config(base)
    record = bodies_for(folder, config, tolerances_of(config, ["controller=±10%"]))
    assert record.proved
    vary = {
        "controller.K_r": {"scale": {"values": [0.92, 1.0, 1.08, 1.2]}},
        SPIN: {"values": [1.0, 40.0]},
    }
    plan = load_plan({"base": base, "vary": vary})
    run_sweep(folder / "sweep", plan, threads=1, factory=factory_for("scipy"))
    return folder, plan, record


def test_members_inside_the_box_and_below_its_level_are_proved(sweep):
    folder, _, record = sweep
    table = rbstab.open_sweep(folder / "sweep")
    inside = np.repeat([True, True, True, False], 2)
    below = table["lyapunov_start"] < record.level
    assert below.tolist() == [True, False] * 4
    expected = np.where(inside & below, "proved", "unknown")
    assert table.words("convergence").tolist() == expected.tolist()
    assert table["proved_rest_state"].tolist() == (inside & below).astype(int).tolist()


def test_a_member_that_approaches_a_state_outside_of_the_range_is_not_proved(sweep):
    folder, plan, _ = sweep
    table = rbstab.open_sweep(folder / "sweep")
    columns: Any = {name: table[name].copy() for name in START_COLUMNS}
    proofs = BoxProofs(plan, ["permanent"], folder)
    assert proofs.proved(0, plan.members, columns)[0]
    for Theta in ([0, 2.0, 0], np.nan):
        columns["rest_orientation"][0] = Theta
        assert not proofs.proved(0, plan.members, columns)[0]


def test_the_load_is_that_of_each_member_although_the_base_has_none():
    base = rbstab.load_config(paper_config("permanent", **SHORT))
    K_t = np.array(base.controller.K_t)
    varied = {
        ("gravity", 2): np.array([0.0, -10.0]),
        ("controller", "K_t", 2): np.array([K_t[2], K_t[2] / 4]),
    }
    weight = base.body.mass * 10.0
    expected = [0.0, 2 * weight**2 / (K_t[2] / 4)]
    assert robust._load_energies(base, varied, 2) == pytest.approx(expected)


def test_members_without_a_controller_are_never_proved(tmp_path):
    """Their file is written beside the proof of a config with a controller and the same tie."""
    config = rbstab.load_config(config_data({"tie": TIE}, integration=SHORT))
    assert bodies_for(tmp_path, config, tolerances_of(config, ["body.mass=±1%"])).proved
    spin = {SPIN: {"values": [0.0, 0.1]}}
    mass = {"body.mass": {"values": [41.0, 41.1]}}
    base = config_data({"tie": TIE}, None, integration=SHORT)
    run_sweep(
        tmp_path / "sweep",
        load_plan({"base": base, "vary": spin | mass}),
        threads=1,
        factory=factory_for("scipy"),
    )
    table = rbstab.open_sweep(tmp_path / "sweep")
    assert set(table.words("convergence")) == {"unknown"}
    assert not table["proved_rest_state"].any()
