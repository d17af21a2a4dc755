"""Each number of a config reaches its place in the system and in the problem."""

import numpy as np
import pytest
from support.config_elements import EACH_KIND, config_data
from support.configs import (
    BY_VARIANT,
    EMBEDDED,
    MANIFOLD,
    PERMANENT,
    SLIDING,
    VISCO_ELASTIC,
    edited,
    plain,
)
from support.inputs import SINE, couple
from support.stops import stop
from support.switching import guard, ligament

from rbstab.config.build import problem_of, system_of
from rbstab.config.load import load_config
from rbstab.systems.parameters import parameters

GRAVITY = np.array([0.3, -0.2, -9.81])


def problem(text, *changes):
    return problem_of(load_config(plain(text), changes))


@pytest.mark.parametrize("variant", BY_VARIANT)
def test_each_number_of_body_gravity_and_controller_by_itself(variant):
    """Also where each diagonal is written as its matrix. All entries differ, so no mix-up hides."""
    data = plain(BY_VARIANT[variant]) | {"gravity": GRAVITY}
    gains = [key for key in data["controller"] if key != "variant"]
    matrices = [np.diag(row) for row in np.arange(1.0, 1 + 3 * len(gains)).reshape(-1, 3)]
    expected = dict(zip(gains, matrices, strict=True)) | {"inertia": np.diag([10, 8, 0.4])}
    expected |= {"mass": 41, "contact_point": [0.15, 0.10, -0.42], "weight": 41 * GRAVITY}
    for form in (np.diag, np.array):
        data["body"]["inertia"] = form(expected["inertia"])
        data["controller"] |= {gain: form(expected[gain]) for gain in gains}
        numbers = parameters(system_of(load_config(data)))
        assert not numbers.pop("anchor").any()
        assert sorted(name.rpartition(".")[2] for name in numbers) == sorted(expected)
        for name, value in numbers.items():
            np.testing.assert_allclose(value, expected[name.rpartition(".")[2]], rtol=1e-15)


def test_each_number_of_an_element_by_itself():
    switching = {
        "line": ligament(damping=3.0),
        "soft": guard("repelling", 7.0, 0.25),
        "stiff": guard("stiff", 8.0, 0.2),
        "end": stop(0.6, 1.2),
    }
    elements = EACH_KIND | switching
    system = system_of(load_config(config_data(elements, controller=None)))
    kinds = {element.name: type(element).__name__ for element in system.elements}
    assert kinds == {
        "gravity": "Gravity",
        "end": "Stop",
        "line": "Ligament",
        "range": "Barrier",
        "soft": "RepellingGuard",
        "stiff": "StiffGuard",
        "strut": "Spring",
        "tie": "ViscoElasticTie",
        "upright": "AttitudeSpring",
    }
    values = parameters(system)
    for name, section in elements.items():
        for key, value in section.items():
            if key not in {"kind", "method"}:
                matrix = np.diag(value) if key in {"K", "L", "L_c"} else value
                assert values[f"{name}.{key}"].tolist() == np.array(matrix).tolist()
    assert parameters(system_of(load_config(config_data({"a": ligament()}))))["a.damping"] == 0.0


def test_only_the_direction_of_an_input_counts():
    for direction in ([1, -2, 2], [0.5, -1, 1]):
        config = load_config(config_data({"a": couple(SINE, direction=direction)}))
        unit_vector = parameters(system_of(config))["a.direction"]
        np.testing.assert_allclose(unit_vector, np.array([1, -2, 2]) / 3, rtol=1e-15)


@pytest.mark.parametrize("text", [PERMANENT, VISCO_ELASTIC, EMBEDDED])
def test_the_anchor_is_zero_or_where_the_loaded_spring_balances(text):
    """K_t X = m g."""
    gravity = f"gravity={GRAVITY.tolist()}"
    assert not problem(text, gravity).system.anchor.any()
    K = np.array([[4000.0, 500, 0], [500, 3000, 200], [0, 200, 5000]])
    changes = (gravity, "controller.anchor=equilibrium", f"controller.K_t={K.tolist()}")
    assert K @ problem(text, *changes).system.anchor == pytest.approx(41.0 * GRAVITY, rel=1e-12)


@pytest.mark.parametrize("coordinates", ["reduced", "manifold"])
@pytest.mark.parametrize("anchor", ["origin", "equilibrium"])
def test_the_held_body_starts_on_the_sub_manifold(coordinates, anchor):
    held = problem(
        PERMANENT,
        f"integration.coordinates={coordinates}",
        f"controller.anchor={anchor}",
        "gravity=[1, 2, -9.81]",
        "initial.orientation=[0.3, -0.4, 0.5]",
    )
    motion = held.system.motion(held.start)
    assert motion.Theta.tolist() == [0.3, -0.4, 0.5]
    assert motion.Omega.tolist() == [16.0, 32.0, -16.0]
    assert np.abs([motion.E, motion.F]).max() < 1e-14
    assert len(held.start) == {"reduced": 6, "manifold": 12}[coordinates]


@pytest.mark.parametrize("coordinates", ["Z", "W"])
@pytest.mark.parametrize("variant", ["free", "visco-elastic", "embedded"])
def test_the_start_is_the_one_that_was_given(variant, coordinates):
    tied = problem(
        BY_VARIANT[variant],
        "initial.orientation=[0.3, -0.4, 0.5]",
        "initial.position=[1, 2, 3]",
        "initial.velocity=[4, 5, 6]",
        f"integration.coordinates={coordinates}",
        *["initial.connector_state=[7, 8, 9]"] * (variant == "embedded"),
    )
    motion = tied.system.motion(tied.start)
    assert motion.Theta.tolist() == [0.3, -0.4, 0.5]
    assert motion.Omega.tolist() == [16.0, 32.0, -16.0]
    np.testing.assert_allclose(motion.X, [1, 2, 3], rtol=1e-14)
    np.testing.assert_allclose(motion.V, [4, 5, 6], rtol=1e-13)
    assert tied.system.coordinates.name == coordinates
    assert tied.start[12:].tolist() == [7, 8, 9] * (variant == "embedded")


def test_settings_arrive():
    settings = {"rtol": 1e-7, "atol": 1e-8, "method": "Radau", "range_bound": 0.2}
    settings |= {"step_limit": 55, "time_limit": 66}
    changes = [f"integration.{key}={value}" for key, value in settings.items()]
    given = problem(VISCO_ELASTIC, "integration.duration=3", "integration.samples=7", *changes)
    assert given.times.tolist() == [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0]
    assert {key: getattr(given, key) for key in settings} == settings


@pytest.mark.parametrize(
    ("text", "control", "projects", "rate"),
    [
        (PERMANENT, "none", False, None),
        (MANIFOLD, "none", False, 0.0),
        (MANIFOLD, "projection", True, 0.0),
        (MANIFOLD, "{baumgarte: 5}", False, 5.0),
    ],
)
def test_drift_control_arrives(text, control, projects, rate):
    given = problem(text, f"integration.drift_control={control}")
    assert given.project is projects
    assert parameters(given.system).get("manifold.baumgarte_rate") == rate


@pytest.mark.parametrize(
    ("law", "layered", "step"),
    [
        ("exact", False, 0.0),
        ("{boundary_layer: 0.5}", True, 0.0),
        ("{implicit: 0.25}", False, 0.25),
    ],
)
def test_the_law_of_a_sliding_connector_arrives(law, layered, step):
    switching = problem(edited("  K_t:", f"  law: {law}\n  K_t:", SLIDING)).switching
    assert switching is not None
    assert (switching.layered, switching.step) == (layered, step)
    assert problem(VISCO_ELASTIC).switching is None
