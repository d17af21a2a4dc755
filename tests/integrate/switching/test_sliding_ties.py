"""Protects one sliding tie: crossing, sliding and release at any point, and its config.

Independent facts: a tie at the contact point is the sliding controller, which has a driver of its
own; a mass alone bounces along parabolas, or decays as exp(-κt).
"""

import numpy as np
import pytest
from support.sliding_ties import as_tie, sliding_example, tie
from support.switching import ENGINES, MASS, data, solved

import rbstab
from rbstab.config.errors import ConfigError
from rbstab.config.load import load_config
from rbstab.systems.modes import modes_of

EACH = pytest.mark.parametrize("engine_name", ENGINES)


# A tie at the contact point is the sliding controller.


@pytest.mark.parametrize(
    ("name", "engine_name", "bound"),
    [
        ("slope_exact_2000", "scipy", 1e-10),
        ("slope_exact_20000", "scipy", 1e-10),
        pytest.param("slope_layer_2000", "scipy", 1e-10, marks=pytest.mark.heavy),
        # On s = E each switch amplifies errors.
        pytest.param("position_exact_2000", "scipy", 2e-9, marks=pytest.mark.heavy),
        ("position_layer_2000", "scipy", 1e-10),
        pytest.param("slope_exact_2000", "heyoka", 1e-10, marks=pytest.mark.heavy),
        pytest.param("position_exact_2000", "heyoka", 2e-9, marks=pytest.mark.heavy),
    ],
)
def test_a_tie_at_the_contact_point_is_the_sliding_controller(name, engine_name, bound):
    config = sliding_example(name, engine=engine_name)
    controller, named = rbstab.simulate(config), rbstab.simulate(as_tie(config))
    assert named.status == controller.status == "completed"
    for quantity in ("orientation", "angular_velocity", "contact_displacement", "contact_velocity"):
        scale = max(np.abs(controller[quantity]).max(), 1.0)
        assert np.abs(named[quantity] - controller[quantity]).max() < bound * scale, quantity
    force = np.abs(controller["contact_force"]).max()
    difference = np.abs(named["element_force"][:, 0] - controller["contact_force"])
    assert difference.max() < 1e3 * bound * force


# A mass alone, in closed form.

K, G, START, SPEED = 30.0, 4.0, 0.5, -0.3
"""The force of the tie, N; the load MASS G along x, N; E and its rate at the start, m and m/s."""


def falling(surface, **integration):
    start = {"position": [START, 0.0, 0.0], "velocity": [SPEED, 0.0, 0.0]}
    settings = {"duration": 4.0, "samples": 81} | integration
    # Beside x the other axes of the tie are at rest on their surfaces.
    body = {"mass": MASS, "inertia": [1.0, 1.5, 2.0], "contact_point": [0.0, 0.0, 0.0]}
    shifted = tie(force=K, surface=surface) | {"anchor": [0.0, -1.0, 1.0]}
    anchored = shifted if surface == "position" else tie(force=K, surface=surface)
    return data({"tie": anchored}, start, settings, gravity=[G, 0.0, 0.0], body=body)


def bouncing(times):
    """Return E along x of a mass under the load and the force -K sgn E, by parabolas."""
    E, F, t = START, SPEED, 0.0
    path = []
    for time in times:
        while True:
            side = 1.0 if (E > 0 or (E == 0 and F > 0)) else -1.0
            a = G - side * K / MASS
            roots = np.roots([a / 2, F, E]) if E != 0 else np.array([-2 * F / a])
            flight = min(r.real for r in roots if abs(r.imag) < 1e-12 and r.real > 1e-12)
            if t + flight > time:
                break
            E, F, t = 0.0, F + a * flight, t + flight
        rest = time - t
        path.append(E + F * rest + a * rest * rest / 2)
    return np.array(path)


@EACH
def test_a_mass_bounces_along_parabolas(engine_name):
    """The other axes lie far from E = 0, and move along parabolas too."""
    trajectory = solved(falling("position"), engine_name)
    assert trajectory.status == "completed"
    np.testing.assert_allclose(
        trajectory.states[:, 6], bouncing(trajectory.times), rtol=0, atol=1e-9
    )


@EACH
def test_a_mass_arrives_slides_and_decays(engine_name):
    """With s = F + κE it arrives once, and then E decays as exp(-κt) under a force in the box."""
    slope = 3.0
    trajectory = solved(falling({"slope": slope}), engine_name)
    assert trajectory.status == "completed"
    a = G - K / MASS
    # s(t) = F + κE is quadratic in t until it is zero.
    roots = np.roots([slope * a / 2, a + slope * SPEED, SPEED + slope * START])
    arrival = min(r.real for r in roots if r.real > 0)
    E = START + SPEED * arrival + a * arrival**2 / 2
    after = trajectory.times > arrival
    expected = E * np.exp(-slope * (trajectory.times[after] - arrival))
    np.testing.assert_allclose(trajectory.states[after, 6], expected, rtol=0, atol=1e-11)
    np.testing.assert_allclose(trajectory.states[after, 9], -slope * expected, rtol=0, atol=1e-11)
    for system, y in zip(trajectory.systems[-40:], trajectory.states[-40:], strict=True):
        motion, pairs = system.acting(y)
        force = next(
            element.wrench(motion, states).force for element, states in pairs if element.slides
        )
        # m Ë = m κ² E = m g + Λ
        assert force[0] == pytest.approx(MASS * (slope**2 * y[6] - G), abs=1e-9)
        assert np.abs(force[1:]).max() < 1e-12
    assert modes_of(trajectory.systems[-1]) == (1.0,) * 6
    # On y and z the mass begins on the surfaces, and stays there.
    assert np.abs(trajectory.states[:, 7:9]).max() < 1e-12


# Its config.


def refusal(elements):
    with pytest.raises(ConfigError) as error:
        load_config(data(elements))
    return str(error.value)


def test_what_a_config_may_not_have():
    slope = {"slope": 2.0}
    said = refusal({"one": tie(law={"implicit": 1e-3})})
    assert "elements.one.law.implicit: is unknown (expected one of boundary_layer)" in said
    assert "elements.one.surface.slope: is -1" in refusal({"one": tie(surface={"slope": -1.0})})
    said = refusal({"one": tie(law={"boundary_layr": 0.1})})
    assert "elements.one.law.boundary_layr: is unknown (did you mean boundary_layer?)" in said
    said = refusal({"one": tie(surface=slope), "two": tie(surface=slope)})
    assert "elements: has the sliding ties one and two at one point" in said
    many = {f"t{k}": tie([0.1 * k, 0.0, 0.2 * k * k], surface=slope) for k in range(4)}
    assert "elements: has 4 sliding ties on slopes with the exact law" in refusal(many)
    layered = {name: element | {"law": {"boundary_layer": 0.1}} for name, element in many.items()}
    load_config(data(layered))


def test_a_tie_that_begins_at_rest_on_position_ends_with_its_name():
    """On s = E nothing holds an axis at rest: its bounces have no length."""
    trajectory = solved(data({"one": tie()}, gravity=[0.0, 0.0, -9.81]), "scipy")
    assert trajectory.status == "solver failure"
    assert "the motion stays where one switches" in trajectory.detail
