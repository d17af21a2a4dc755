"""Protects sliding members: the same bits in any order and batch, and each fails alone."""

import threading
from typing import Any

import numpy as np
import pytest
from support.hang_guard import within
from support.paper_runs import paper_config

from rbstab.experiment import record
from rbstab.experiment.simulate import simulate
from rbstab.integrate.status import RunStatus
from rbstab.sweep.members.engines import factory_for
from rbstab.sweep.members.outcome import COLUMNS, STATUSES
from rbstab.sweep.plan.dump import plan_data
from rbstab.sweep.plan.load import load_plan

SHORT: dict[str, Any] = {"duration": 0.1, "samples": 5, "rtol": 1e-10, "engine": "heyoka"}

SLOPE = {"variant": "sliding", "K_s": [20000.0] * 3, "surface": {"slope": 20.0}}
POSITION = {"variant": "sliding", "K_s": [2000.0] * 3, "surface": "position"}
IMPLICIT = {**SLOPE, "law": {"implicit": 1e-3}}

SPIN = {"initial.angular_velocity[0]": {"uniform": [-30, 30]}}
BOUNDS = {"controller.K_s": {"scale": {"uniform": [0.1, 2.0]}}}


def plan_of(controller, vary, members=8, **integration):
    base = paper_config("free", False, controller=controller, **{**SHORT, **integration})
    drawn = {"design": "random", "members": members, "seed": 5}
    return load_plan({"title": "Sliding", "base": base, "vary": vary, **drawn})


def side_by_side():
    """Return a plan of four sliding members and four batched ones, in alternating pairs."""
    base = paper_config("visco-elastic", False, controller=SLOPE | {"variant": "sliding"}, **SHORT)
    vary = {
        "body.mass": {"values": [40.0, 42.0]},
        "controller.variant": {"values": ["sliding", "visco-elastic"]},
        "initial.angular_velocity[1]": {"values": [5.0, 20.0]},
    }
    return load_plan({"title": "Side by side", "base": base, "vary": vary})


PLANS = {
    "s = F + 20 E": lambda: plan_of(SLOPE, SPIN | BOUNDS),
    "s = E": lambda: plan_of(POSITION, SPIN | BOUNDS),
    "implicit": lambda: plan_of(IMPLICIT, SPIN),
    "side by side": side_by_side,
}


def bits(shard, members=slice(None)):
    return {name: shard.outcome[name][members].tobytes() for name in COLUMNS}


def whole(plan):
    """Compute all members by a new engine in a thread of its own."""
    return within(120.0, lambda: factory_for("heyoka")(plan).compute(0, plan.members))


@pytest.fixture(scope="module")
def alone():
    """By name: each plan, and all its members computed in one batch."""
    made = {name: make() for name, make in PLANS.items()}
    return {name: (plan, whole(plan)) for name, plan in made.items()}


def test_they_are_followed(alone):
    for _, shard in alone.values():
        assert {STATUSES[code] for code in shard.outcome["status"]} == {RunStatus.COMPLETED}
        assert np.isfinite(shard.outcome["lyapunov_end"]).all()


@pytest.mark.parametrize("name", PLANS)
@pytest.mark.parametrize("cut", [1, 3])
def test_how_members_are_cut_changes_no_bit(alone, name, cut):
    plan, expected = alone[name]
    engine = factory_for("heyoka")(plan)
    # From the last batch to the first, so that the engine has computed other members before.
    for start in reversed(range(0, 8, cut)):
        stop = min(start + cut, 8)
        found = engine.compute(start, stop)
        assert bits(found) == bits(expected, slice(start, stop))


def test_plans_by_turns_change_no_bit(alone):
    engines = {name: factory_for("heyoka")(plan) for name, (plan, _) in alone.items()}
    for member in (6, 1, 3):
        for name, engine in engines.items():
            found = engine.compute(member, member + 1)
            assert bits(found) == bits(alone[name][1], slice(member, member + 1)), name


def test_threads_change_no_bit(alone):
    found = {}

    def pieces(number):
        for name, (plan, _) in alone.items():
            engine = factory_for("heyoka")(plan)
            for start in range(2 * number, 8, 4):
                found[name, start] = bits(engine.compute(start, start + 2))

    threads = [threading.Thread(target=pieces, args=(number,)) for number in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(120.0)
    expected = {
        (name, start): bits(shard, slice(start, start + 2))
        for name, (_, shard) in alone.items()
        for start in range(0, 8, 2)
    }
    assert found == expected


def test_a_member_that_reaches_the_switch_limit_fails_alone():
    """A large K_s chatters: the other members have less than a tenth of its switches."""
    controller = {**POSITION, "switch_limit": 100}
    weak, strong = {"values": [500.0]}, {"values": [500.0, 200_000.0, 700.0]}
    plans = [
        load_plan({
            "title": "Chatter",
            "base": paper_config("free", False, controller=controller, **SHORT),
            "vary": {"controller.K_s[1]": axis},
        })
        for axis in (strong, weak)
    ]  # fmt: skip
    found, expected = (within(120.0, whole, plan) for plan in plans)
    ends = [STATUSES[code] for code in found.outcome["status"]]
    assert ends == [RunStatus.COMPLETED, RunStatus.SWITCH_LIMIT, RunStatus.COMPLETED]
    assert 0 < found.outcome["end_time"][1] < 0.1
    for name in set(found.outcome) - {"run_id"}:
        assert found.outcome[name][0].tobytes() == expected.outcome[name][0].tobytes(), name


def test_what_no_column_shows_is_not_asked_for(monkeypatch, alone):
    """Members need no second run behind `trusted_until`, no forces and no certificate."""

    def refuse(*_):
        raise AssertionError("computed although no column needs it")

    monkeypatch.setattr("rbstab.integrate.switching.sliding_connector.trusted_until", refuse)
    monkeypatch.setattr("rbstab.integrate.switching.chatter.Chatter.energy", refuse)
    monkeypatch.setattr(record, "certificate_of", refuse)
    monkeypatch.setattr(record, "_all_at", refuse)
    plan, expected = alone["s = E"]
    assert bits(factory_for("heyoka")(plan).compute(0, 2)) == bits(expected, slice(2))


@pytest.mark.parametrize("name", PLANS)
def test_keeping_motions_changes_no_bit_of_a_column(alone, name):
    """A kept motion has forces, dissipation and v'; the columns need none of them."""
    plan, expected = alone[name]
    kept = whole(load_plan(plan_data(plan) | {"keep": "traces"}))
    assert bits(kept) == bits(expected)
    assert np.isfinite(kept.traces["contact_force"]).all()


def test_each_member_has_the_rest_state_of_its_own_system():
    """Members of the same system share the rest state next to the unloaded position."""
    base = paper_config("free", False, controller=SLOPE, **SHORT)
    vary = {
        "initial.angular_velocity[1]": {"values": [5.0, 20.0]},
        "body.mass": {"values": [40.0, 40.0, 42.0]},
    }
    plan = load_plan({"base": base | {"gravity": [0.0, 0.0, -10.0]}, "vary": vary})
    found = whole(plan).outcome["energy_at_rest"]
    runs = [within(120.0, simulate, plan.config_of(member)) for member in range(plan.members)]
    assert found.tolist() == [float(run["energy_at_rest"]) for run in runs]
    assert found[0] == found[1] == found[3] != found[2]
