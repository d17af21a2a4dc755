"""Protects a sliding controller beside inputs, elements that switch, and elements with own states.

Independent facts: gravity is a weight or an input; both engines agree; v balances with what was
supplied.
"""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

import rbstab
from rbstab.config.errors import ConfigError
from rbstab.config.load import load_config

EXAMPLES = Path(__file__).parents[2] / "configs" / "examples" / "sliding"
ENGINES = ("scipy", "heyoka")
EACH = pytest.mark.parametrize("engine_name", ENGINES)
GRAVITY = [3.0, -5.0, -9.81]

MOTION = ("orientation", "angular_velocity", "contact_displacement", "contact_velocity")


def example(name, elements=None, **integration):
    """Return an example, with elements."""
    config: dict[str, Any] = yaml.safe_load((EXAMPLES / f"{name}.yaml").read_text(encoding="utf-8"))
    config["integration"] |= {"duration": 0.25, "samples": 26} | integration
    return config | ({"schema_version": 2, "elements": elements} if elements else {})


def push(signal, amplitude, direction=(1, 1, 1)):
    """Return a force at the centre of gravity."""
    ends = {"quantity": "force", "point": [0, 0, 0], "direction": list(direction)}
    return {"kind": "input", **ends, "amplitude": amplitude, "signal": signal}


def transitions(run):
    return [
        (int(axis), str(kind))
        for axis, kind in zip(run["transition_axis"], run["transition_kind"], strict=True)
    ]


EMBEDDED = {"kind": "embedded", "point": [0.1, 0, 0.2], "anchor": [0, 0, 0]} | {
    name: [300.0, 200.0, 100.0] for name in ("K_c", "L_c", "K_d", "L_d")
}
TIE = {
    "kind": "sliding",
    "point": [-0.2, 0.1, 0.3],
    "anchor": [-0.2, 0.1, 0.3],
    "K_s": [400.0, 300.0, 200.0],
    "surface": {"slope": 10},
}
STOP = {"end": {"kind": "guard", "method": "stop", "angle": 0.7, "restitution": 0.5}}
SINE = {"push": push({"kind": "sine", "frequency": 3.0}, 500.0)}


@EACH
def test_an_impact_throws_the_axes_off_and_they_arrive_again(engine_name):
    """All of them slide before it and soon after it; at the impact each is released."""
    config = example("slope_exact_20000", STOP, engine=engine_name, samples=251)
    run = rbstab.simulate(config)
    impacts, changes = (
        run["impact_time"],
        list(zip(run["transition_time"], transitions(run), strict=True)),
    )
    assert len(impacts) == 2
    for time, after in zip(impacts, [*impacts[1:], 0.25], strict=True):
        kinds = [kind for t, kind in changes if t == time]
        assert kinds == [(axis, "release") for axis in (1, 2, 3)]
        later = sorted(kind for t, kind in changes if time < t < after)
        assert later == [(axis, "stick") for axis in (1, 2, 3)]
    assert (run["mode"][-1] == 0).all()
    assert run["trusted_until"] == 0.25
    assert (np.abs(run["contact_force"]) <= 20000.0 * (1 + 1e-9)).all()


def weighed(config, size):
    """Return two results: of a controller alone, and with its weight as an input."""
    g = size * np.array(GRAVITY)
    force = config["body"]["mass"] * float(np.linalg.norm(g))
    weight = push({"kind": "constant"}, force, g.tolist())
    given = config | {"schema_version": 2, "elements": {"weight": weight}}
    return rbstab.simulate(config | {"gravity": g.tolist()}), rbstab.simulate(given)


def history(run, first=0.0):
    """Return the times and the kinds of the transitions after a time."""
    later = run["transition_time"] > first
    return run["transition_time"][later], [
        kind for kind, is_later in zip(transitions(run), later, strict=True) if is_later
    ]


@EACH
def test_a_point_at_rest_is_held_until_its_load_is_too_large(engine_name):
    """Under this weight one axis is torn off at once, and another one as the body turns."""
    config = example("position_exact_2000", engine=engine_name)
    alone, beside = weighed(config | {"initial": {}}, 20.0)
    assert beside.status == alone.status == "completed"
    assert (beside["mode"][0] == [0, 0, -1]).all()
    times, kinds = history(beside)
    expected, same = history(alone)
    assert kinds == same == [(2, "release")]
    np.testing.assert_allclose(times, expected, rtol=0, atol=1e-11)
    for quantity in MOTION:
        size = max(np.abs(alone[quantity]).max(), 1.0)
        assert np.abs(beside[quantity] - alone[quantity]).max() < 1e-9 * size, quantity


@EACH
@pytest.mark.parametrize("sign", [1, -1])
def test_a_point_at_rest_is_knocked_off_at_a_breakpoint(engine_name, sign):
    """The force exceeds K_s of one axis for 10 ms; before it nothing moves."""
    knock = {"kind": "pulse", "start": 0.1, "duration": 0.01}
    elements = {"knock": push(knock, 5000.0, (0, sign, 0)) | {"point": [0.15, 0.1, -0.42]}}
    config = example("position_exact_2000", elements, engine=engine_name)
    run = rbstab.simulate(config | {"initial": {}})
    first, kinds = history(run)
    assert (first[0], kinds[0]) == (0.1, (2, "release"))
    before = run["time"] <= 0.1
    assert not run["contact_displacement"][run["time"] < 0.1].any()
    # At the breakpoint the axis is put 1e-13 m beside its surface.
    assert np.abs(run["contact_displacement"][before]).max() <= 1e-13
    assert run["contact_force"][before][-1][1] == -2000.0 * sign
    assert np.sign(run["contact_displacement"][~before][0][1]) == sign
    size = np.abs(run["supplied_energy"]).max()
    assert np.abs(run["energy_residual"]).max() < 1e-10 * size


SLOPE: dict[str, Any] = {"surface": {"slope": 20}}
REFUSED = {
    "implicit": (
        {"law": {"implicit": 1e-4}},
        SINE | {"mount": EMBEDDED},
        "has mount, push beside a sliding connector with implicit steps (expected law: exact",
    ),
    "sticking at a stop": (
        {"stick_energy": 10.0},
        STOP,
        "has end beside a sliding connector with a stick_energy: each impact would throw the axes "
        "off that stick (expected stick_energy: 0, or no stops)",
    ),
    "one point": (
        SLOPE,
        {"tie": TIE | {"point": [0.15, 0.1, -0.42]}},
        "has the sliding ties tie and connector at one point",
    ),
    "many": (
        SLOPE,
        {f"tie_{k}": TIE | {"point": [0.1 * k, 0.0, 0.0]} for k in range(3)},
        "has 4 sliding ties on slopes with the exact law: tie_0, tie_1, tie_2, connector",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_refused_beside_it(case):
    changes, elements, words = REFUSED[case]
    config = example("position_exact_2000", elements)
    with pytest.raises(ConfigError) as caught:
        load_config(config | {"controller": config["controller"] | changes})
    (problem,) = caught.value.problems
    assert f" elements: {words}" in str(problem)
    if case == "implicit":
        smooth = {"spring": {"kind": "attitude", "K": [1.0] * 3, "L": [1.0] * 3}}
        load_config(
            example("position_exact_2000", smooth) | {"controller": config["controller"] | changes}
        )
