"""Protects springs without length: a status where a motion arrives there, on both engines.

A mass that is thrown straight at the anchor of its spring meets it at a time in closed form: on the
way, the spring is an oscillator about its length without force. Beside the anchor it moves on.
"""

import numpy as np
import pytest
from support.switching import ENGINES, MASS, data, ligament, solved

import rbstab
from rbstab.config.build import problem_of
from rbstab.config.errors import ConfigError
from rbstab.config.load import load_config
from rbstab.integrate.status import RunStatus
from rbstab.sweep.options import SweepOptions
from rbstab.sweep.plan.load import load_plan
from rbstab.sweep.sweep import sweep_to_folder

STIFFNESS, REST, SPEED = 40.0, 0.5, 10.0
EACH = pytest.mark.parametrize("engine_name", ENGINES)


def spring(**changes):
    ends = {"point": [0, 0, 0], "anchor": [0, 0, 0]}
    return {"kind": "spring", **ends, "stiffness": STIFFNESS, "rest_length": REST} | changes


def thrown(element=None, aside=0.0, elements=None, **integration):
    """Return a mass 1 m above its anchor that moves down."""
    start = {"position": [aside, 0, 1.0], "velocity": [0, 0, -SPEED]}
    return data(
        {"strut": element or spring()} | (elements or {}), start, {"duration": 1.0} | integration
    )


def arrival():
    """Return when z = ℓ₀ + (1 - ℓ₀) cos ωt - (SPEED/ω) sin ωt falls to zero."""
    frequency = np.sqrt(STIFFNESS / MASS)
    amplitude = np.hypot(1.0 - REST, SPEED / frequency)
    phase = np.arctan2(SPEED / frequency, 1.0 - REST)
    return (np.arccos(-REST / amplitude) - phase) / frequency


@EACH
@pytest.mark.parametrize("method", ["DOP853", "LSODA"])
def test_a_motion_ends_where_its_spring_has_no_length(engine_name, method):
    config = thrown()
    if engine_name == "scipy":
        config["integration"]["method"] = method
    elif method != "DOP853":
        pytest.skip("heyoka has one method")
    trajectory = solved(config, engine_name)
    assert trajectory.status is RunStatus.ZERO_LENGTH
    assert trajectory.times[-1] == pytest.approx(arrival(), abs=1e-5 * REST / SPEED + 1e-7)
    assert np.linalg.norm(trajectory.states[-1][6:9]) < 1.1e-5 * REST
    assert trajectory.detail.startswith(
        "strut has no length, so its direction is undefined at t = "
    )


@EACH
def test_beside_another_element_that_switches(engine_name):
    other = ligament(anchor=[0, 3, 0], slack_length=9.0)
    trajectory = solved(thrown(elements={"slack": other}), engine_name)
    assert trajectory.status is RunStatus.ZERO_LENGTH
    assert trajectory.times[-1] == pytest.approx(arrival(), abs=2e-6)
    assert "strut has no length" in trajectory.detail


def test_a_motion_that_passes_by_goes_on():
    config = thrown(aside=1e-3)
    scipy, heyoka = (solved(config, name) for name in ENGINES)
    assert scipy.status is heyoka.status is RunStatus.COMPLETED
    assert scipy.times[np.abs(scipy.states[:, 8]).argmin()] > 0.05
    np.testing.assert_allclose(scipy.states[-1], heyoka.states[-1], atol=1e-6)


@EACH
@pytest.mark.parametrize("position", [[0, 0, 0], [0, 0, 3e-6]])
def test_a_start_without_length_has_the_status(engine_name, position):
    given = problem_of(load_config(thrown()))
    start = given.start.copy()
    start[6:9] = position
    trajectory = solved_problem(given, start, engine_name)
    assert trajectory.status is RunStatus.ZERO_LENGTH
    assert trajectory.times.tolist() == [0.0]


def solved_problem(given, start, engine_name):
    from dataclasses import replace

    from rbstab.integrate.engines import engine

    return engine(engine_name)(replace(given, start=start))


# In a config.


def test_a_damper_without_rest_length_needs_a_direction():
    with pytest.raises(ConfigError, match="visco-elastic"):
        rbstab.load_config(data({"a": spring(rest_length=0, damping=3.0)}))
    with pytest.raises(ConfigError, match="rest_length"):
        rbstab.load_config(data({"a": spring(rest_length=-1e-9)}))


@pytest.mark.slow
@pytest.mark.parametrize("engine_name", ENGINES)
def test_the_member_of_a_sweep_has_the_status(tmp_path, engine_name):
    """Members at x = -1, 0 and 1 mm: only the one in the middle arrives; one starts there."""
    base = thrown(engine=engine_name, duration=0.3, samples=11)
    vary = {"initial.position[0]": {"values": [-1e-3, 0.0, 1e-3]}}
    vary |= {"initial.position[2]": {"values": [0.0, 1.0]}}
    plan = load_plan({"title": "Zero", "base": base, "vary": vary, "keep": "traces"})
    sweep_to_folder(plan, tmp_path / "a", SweepOptions(threads=1))
    table = rbstab.open_sweep(tmp_path / "a")
    at_anchor = table["initial_position_0"] == 0.0
    words = np.array(table.words("status"))
    assert set(words[at_anchor]) == {"zero length"}
    assert set(words[~at_anchor]) == {"completed"}
    from_above = at_anchor & (table["initial_position_2"] == 1.0)
    np.testing.assert_allclose(table["end_time"][from_above], arrival(), atol=2e-6)


# A spring of no rest length.


def test_a_plan_cannot_vary_what_its_formulas_leave_out():
    base = data({"a": spring(rest_length=0)})
    vary = {"elements.a.rest_length": {"values": [0.0, 0.5]}}
    with pytest.raises(ConfigError, match="is varied, but the base has a spring of rest_length 0"):
        load_plan({"title": "t", "base": base, "vary": vary})
    load_plan({"title": "t", "base": data({"a": spring(anchor=[0, 0, 2])}), "vary": vary})
    stiffness = {"elements.a.stiffness": {"values": [1.0, 2.0]}}
    load_plan({"title": "t", "base": base, "vary": stiffness})
