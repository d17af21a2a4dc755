"""A result warns about quantities that are too small for the tolerance of their run."""

from types import SimpleNamespace

import numpy as np
import pytest
from support.configs import EMBEDDED, PERMANENT, plain

from rbstab.config.build import system_of
from rbstab.config.load import load_config
from rbstab.experiment.resolution import inverse_warnings, resolution_warnings
from rbstab.integrate.problem import Trajectory
from rbstab.integrate.status import RunStatus
from rbstab.store.variables import Variable

LARGE = {"orientation": 1.0, "angular_velocity": 1.0, "position": 1.0, "velocity": 1.0}


def warned(sizes, *, engine="scipy", largest=1.0, status=RunStatus.COMPLETED, rtol=1e-12):
    """Return the names that are warned about, each with its number of digits."""
    variables = {
        name: Variable(("time", "axis"), np.array([[0.0, -size, 0.0], [0.0, 0.0, 0.0]]), "u", name)
        for name, size in (LARGE | sizes).items()
    }
    states = np.array([[0.0, -largest], [0.1, 0.0]])
    zero = np.zeros(2)
    trajectory = Trajectory(zero, states, zero, zero, status, "", 1, 1)
    integration = SimpleNamespace(engine=engine, rtol=rtol, atol=1e-10)
    warnings = resolution_warnings(integration, trajectory, variables)
    return {text.split(":")[0]: int(text.split("guarantees ")[1].split()[0]) for text in warnings}


@pytest.mark.parametrize(
    ("sizes", "expected"),
    [
        ({}, {}),
        ({"position": 0.0}, {}),
        ({"position": 1.01e-2}, {}),
        ({"position": 0.9e-2}, {"position": 7}),
        ({"position": 1e-6}, {"position": 4}),
        ({"position": 1e-12}, {"position": 0}),
    ],
)
def test_scipy_resolves_its_absolute_tolerance(sizes, expected):
    assert warned(sizes) == expected


def test_heyoka_resolves_a_share_of_the_largest_state():
    small = {"orientation": 1e-2, "velocity": 1e-3}
    assert warned(small, engine="heyoka") == {}
    assert warned(small, engine="heyoka", largest=1.5e2) == {"orientation": 7, "velocity": 6}
    assert warned(small, engine="heyoka", largest=1.5e2, rtol=1e-14) == {}


@pytest.mark.parametrize("status", RunStatus)
def test_a_run_that_met_a_limit_has_its_status(status):
    """A motion that ends at an event is as accurate as one that ends at its last sample."""
    complete = status in {RunStatus.COMPLETED, RunStatus.RANGE_LEFT, RunStatus.ZERO_LENGTH}
    assert bool(warned({"position": 1e-9}, status=status)) is complete


def turned(values):
    Q, _ = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))
    matrix = Q @ np.diag(values) @ Q.T
    return (0.5 * (matrix + matrix.T)).tolist()


def lost(text, change):
    """Return the names of the matrices that a config is warned about."""
    system = system_of(load_config(plain(text), [change]))
    return [warning.split(":")[0] for warning in inverse_warnings(system)]


@pytest.mark.parametrize(
    ("values", "expected"), [([1e4, 1e2, 1.0], []), ([1e8, 1e4, 1.0], ["body.inertia"])]
)
def test_an_inertia_of_very_different_moments_loses_digits(values, expected):
    assert lost(EMBEDDED, f"body.inertia={turned(values)}") == expected
    assert lost(EMBEDDED, f"body.inertia={values}") == []


def test_the_inertia_of_a_held_body_is_that_about_its_contact_point():
    """m (R'R I - RR') with R = 0.45 m and 41 kg adds 8 kg m² to the smallest moments."""
    assert lost(PERMANENT, f"body.inertia={turned([1e4, 1e-3, 1e-3])}") == []
    assert lost(EMBEDDED, f"body.inertia={turned([1e4, 1e-3, 1e-3])}") == ["body.inertia"]


def test_the_damping_of_an_own_state_is_inverted_too():
    assert lost(EMBEDDED, f"controller.L_d={turned([1e8, 1e4, 1.0])}") == ["controller.L_d"]
    assert lost(EMBEDDED, f"controller.L_c={turned([1e8, 1e4, 1.0])}") == []
