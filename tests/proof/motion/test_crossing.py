"""Steps through switches hold the exact motions, whose crossings are found in 220 bits."""

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from support.exact_motions import state_through
from support.motion_steps import equations, exact_system, some_starts
from support.polynomial_sets import place_in_frame, state_of
from support.start_sets import random_config, random_set

from rbstab.elements.spring import squared_length
from rbstab.experiment.convergence.enclosed_system import enclosed_system
from rbstab.proof.motion.crossing import switching_step
from rbstab.proof.motion.motion_set import MotionSet
from rbstab.systems.modes import with_modes

AT, BEGIN = 0.0021, 0.0016
"""s: when the middle of the set crosses, and when the set begins."""

LIGAMENT = {
    "kind": "ligament",
    "point": [0.1, 0.05, 0.2],
    "anchor": [0.9, -0.3, 0.4],
    "stiffness": 9e4,
    "toe_strain": 0.001,
    "damping": 700.0,
    "slack_length": 1.0,
}
KINDS = {
    "stiff": {"kind": "guard", "method": "stiff", "stiffness": 9e5, "soft_angle": 1.0},
    "repelling": {"kind": "guard", "method": "repelling", "couple": 4e3, "soft_angle": 1.0},
    "ligament": LIGAMENT,
}
PARAMETER = {"stiff": "soft_angle", "repelling": "soft_angle", "ligament": "slack_length"}


def moved(kind, value, variant, coordinates):
    """Return a config whose switch is at a value, and its state in doubles at a time."""
    element = KINDS[kind] | {PARAMETER[kind]: value}
    return random_config(variant, coordinates, 5, schema_version=2, elements={"it": element})


def about_to_switch(kind, variant="visco-elastic", coordinates="Z", **shape):
    """Return a config and a set of states that begin to switch soon, and a size of the states."""
    far = moved(kind, 1.5 if kind != "ligament" else 3.0, variant, coordinates)
    states, scale = random_set(far, 7, **shape)
    system = enclosed_system(far, lambda values: values)
    y = np.array(states.polynomial[0, :, 0])
    y[4] = 9.0 if y[1] > 0 else -9.0
    path = solve_ivp(
        lambda _, s: system.rates(s), (0, AT), y, rtol=1e-12, atol=1e-12, t_eval=[BEGIN, AT]
    )
    states.polynomial[0, :, 0] = path.y[:, 0]
    if kind == "ligament":
        element: Any = next(candidate for candidate in system.elements if candidate.name == "it")
        place = np.sqrt(squared_length(system.motion(path.y[:, 1]), element.point, element.anchor))
    else:
        place = abs(path.y[1, 1])
    return moved(kind, round(float(place), 9), variant, coordinates), states, scale


def followed_through(config, states, scale, until=0.0012):
    """Return the set after some steps, the time, and the numbers of steps and of undecided ends."""
    time, longest, count, on_surface = 0.0, np.array([0.002]), 0, 0
    while time < until:
        step, longest, switch = switching_step(equations(config), states, scale, longest)
        if not step.proved[0]:
            assert longest[0] > 1e-8, "no step"
            continue
        time, states = time + float(step.h[0]), step.end
        count, on_surface = count + 1, on_surface + bool(switch)
    return states, time, count, on_surface


POINT = {"variables": 0, "degree": 0}
NARROW = ("permanent", "reduced", POINT | {"error": 1e-12}, 3e-10)
WIDE = ("visco-elastic", "Z", POINT | {"error": 1e-7}, 1e-5)
SET = ("permanent", "reduced", {"variables": 2, "degree": 3, "width": 1e-4, "error": 1e-9}, 1e-4)


@pytest.mark.parametrize(
    ("kind", "variant", "coordinates", "shape", "widest"),
    [
        ("repelling", *NARROW),
        ("ligament", *NARROW),
        ("stiff", *WIDE),
        ("repelling", *WIDE),
        ("repelling", *SET),
    ],
)
def test_every_start_of_a_set_is_in_it_after_a_switch(kind, variant, coordinates, shape, widest):
    config, states, scale = about_to_switch(kind, variant, coordinates, **shape)
    before = equations(config).possible(states.models)
    end, time, *_ = followed_through(config, states, scale)
    assert before != equations(config).possible(end.models)
    assert np.all(end.error < widest * scale)
    assert 1e-3 < farthest(config, states, end, time) <= 1


def farthest(config, states, end, time):
    """Return the largest place of exact ends in the frame of a set, relative to its radii."""
    places = []
    for z, w in some_starts(states, 2):
        y = state_of(states, z.tolist(), w.tolist())
        there, crossings = state_through(exact_system(config), y, time)
        assert crossings >= 1
        places.append(place_in_frame(end, z.tolist(), there) / end.radius[0])
    return np.abs(places).max()


@pytest.mark.parametrize("kind", KINDS)
def test_a_thin_set_bends_at_a_surface(kind):
    """By how the jump of the rates varies, and by the form of the surface."""
    config, states, scale = about_to_switch(kind, "permanent", "reduced", width=0.0, error=3e-5)
    states.radius[0, np.arange(6) != 1] = 0.0
    end, time, *_ = followed_through(config, states, scale)
    assert farthest(config, states, end, time) <= 1


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_grazing(sign):
    """A set of which a part crosses, and comes back, or none does; nothing is lost."""
    config, states, scale = about_to_switch("stiff", "permanent", "reduced", **POINT, error=1e-9)
    system = with_modes(enclosed_system(config, lambda values: values), (0.0, 0.0))

    def turns(_, y):
        return system.rates(y)[1]

    turns.terminal = True  # type: ignore[attr-defined]
    y = states.polynomial[0, :, 0].copy()
    y[3:6] = 0.0
    towards = -np.sign(system.rates(y)[1 + 3])
    y[1], y[4] = towards * abs(y[1]), towards * 0.05
    assert np.sign(system.rates(y)[4]) == -towards
    path = solve_ivp(
        lambda _, s: system.rates(s), (0, 0.3), y, rtol=1e-13, atol=1e-13, events=turns
    )
    peak = abs(path.y_events[0][0][1])
    config = moved("stiff", float(peak - sign * 1e-10), "permanent", "reduced")
    t = float(path.t_events[0][0])
    assert 1e-4 < t < 0.2
    states = MotionSet(states.space, y[np.newaxis, :, np.newaxis], states.frame, states.radius)
    end, time, _, on_surface = followed_through(config, states, scale, t + 2e-3)
    assert on_surface > 0
    assert np.all(end.error < 1e-6 * scale)
    assert len(equations(config).possible(end.models)[0]) == 1
    free = solve_ivp(lambda _, s: system.rates(s), (0, time), y, rtol=1e-13, atol=1e-13).y[:, -1]
    place = np.linalg.solve(end.frame[0], free - end.polynomial[0, :, 0])
    assert np.all(np.abs(place) <= end.radius[0] + 1e-9)


@pytest.mark.parametrize("rests", [False, True])
def test_a_start_on_a_surface(rests):
    """It leaves it with its speed; but where a repelling guard holds a load, nothing is proved."""
    _, states, scale = about_to_switch("repelling", **POINT, error=1e-12)
    y = states.polynomial[0, :, 0]
    if rests:
        y[3:6] = 0.0
        base = moved("repelling", 1.5, "visco-elastic", "Z")
        pushed = enclosed_system(base, lambda values: values).rates(y)[4]
        y[1] = abs(y[1]) * np.sign(pushed)
    angle = round(float(abs(y[1])), 9)
    y[1] = np.sign(y[1]) * angle
    config = moved("repelling", angle, "visco-elastic", "Z")
    longest, time, name, until = np.array([0.002]), 0.0, "", 0.1 if rests else 1e-3
    while time < until and states.error.max() < 1e-2 and longest[0] > 1e-8:
        step, longest, name = switching_step(equations(config), states, scale, longest)
        if step.proved[0]:
            time, states = time + float(step.h[0]), step.end
    if rests:
        assert name == "it"
        assert time < until
    else:
        assert np.all(states.error < 1e-9 * scale)
        assert sorted(map(len, equations(config).possible(states.models))) == [1, 1]
