"""Energy through hundreds of switches: conserved, or lost as the audit says; both engines agree."""

from typing import Any

import numpy as np
import pytest
from support.switching import ENGINES, data, guard, ligament, problem, solved

from rbstab.integrate.engines import engine

EACH = pytest.mark.parametrize("engine_name", ENGINES)

CLOUD: dict[str, dict[str, Any]] = {
    "a": {"point": [0.1, 0.0, 0.0], "anchor": [1.0, 0.1, 0.0]},
    "b": {"point": [-0.1, 0.1, 0.0], "anchor": [-1.0, 0.0, 0.2]},
    "c": {"point": [0.0, -0.1, 0.1], "anchor": [0.0, -1.0, 0.1]},
    "d": {"point": [0.0, 0.1, -0.1], "anchor": [0.1, 1.0, -0.3]},
}
"""Four ligaments around a body."""


def bouncing(**elements):
    """Return a body that bounces between two ligaments of its centre of gravity, without spin."""
    start = {"velocity": [1.5, 0, 0], "angular_velocity": [0, 1.3, 0]}
    two = {"a": ligament(-1.0, stiffness=800.0), "b": ligament(1.0, stiffness=800.0)}
    return data(two | elements, start, {"duration": 60.0, "samples": 241})


def energies(trajectory):
    pairs = zip(trajectory.systems, trajectory.states, strict=True)
    return np.array([system.observe(y).energy.sum() for system, y in pairs])


def count_switches(config, engine_name, monkeypatch):
    """Return the trajectory and the number of its switches."""
    from rbstab.integrate.switching.driver import Driver

    made = []
    original = Driver.__init__

    def noted(self, *arguments):
        original(self, *arguments)
        made.append(self)

    monkeypatch.setattr(Driver, "__init__", noted)
    trajectory = engine(engine_name)(problem(config))
    (current,) = made
    return trajectory, current.count


@EACH
@pytest.mark.parametrize("method", ["stiff", "repelling"])
def test_energy_is_conserved_over_a_hundred_bounces(engine_name, method, monkeypatch):
    """θ2 bounces between two guards while the mass bounces between two ligaments."""
    config = bouncing(soft=guard(method, 400.0 if method == "stiff" else 20.0))
    settings = {"engine": engine_name, "rtol": 1e-13 if engine_name == "scipy" else 1e-16}
    settings |= {"atol": 1e-13}
    config["integration"] |= settings
    trajectory, count = count_switches(config, engine_name, monkeypatch)
    assert trajectory.status == "completed"
    assert count > 500
    total = energies(trajectory)
    assert np.abs(total - total[0]).max() < 1e-11 * total[0]


@pytest.mark.parametrize("seed", range(12))
def test_v_never_rises_with_one_to_four_ligaments(seed):
    rng = np.random.default_rng(seed)
    names = list(CLOUD)[: rng.integers(1, 5)]
    elements = {
        name: ligament(
            point=(rng.normal(size=3) * 0.2).tolist(),
            anchor=(rng.normal(size=3) * 0.6).tolist(),
            stiffness=float(10 ** rng.uniform(1, 4)),
            slack_length=float(rng.uniform(0.3, 1.0)),
            toe_strain=float(rng.uniform(0.01, 0.2)),
            damping=float(rng.choice([0.0, 3.0])),
        )
        for name in names
    }
    controller = {"variant": "free", "K_t": [40, 50, 60], "L_t": [4, 5, 6]}
    controller |= {"K_r": [30, 40, 50], "L_r": [3, 4, 5]}
    start = {"velocity": rng.normal(size=3).tolist(), "orientation": [0.2, 0.1, -0.3]}
    start |= {"angular_velocity": (rng.normal(size=3)).tolist()}
    config = data(
        elements, start, {"duration": 5.0}, controller=controller, gravity=[0.0, 0.0, -9.81]
    )
    trajectory = solved(config, "scipy", rtol=1e-11, atol=1e-12)
    assert trajectory.status == "completed"
    v = energies(trajectory)
    assert (np.diff(v) < 1e-11 * np.abs(v).max()).all()
    residual = v - v[0] - trajectory.lyapunov_change
    assert np.abs(residual).max() < 1e-9 * np.abs(v).max()
