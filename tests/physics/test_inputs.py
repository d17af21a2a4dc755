"""Driven motions against closed forms, momentum and quadrature; their audit; their breakpoints.

The audit cannot see a breakpoint that was missed. So closed forms hold the motion itself.
"""

from typing import Any

import numpy as np
import pytest
from support.inputs import (
    AUDIT,
    LEGS,
    SIGNALS,
    SINE,
    couple,
    driven,
    force,
    linear_response,
    problem,
    value_at,
)

from rbstab.config.build import _legs
from rbstab.config.load import load_config
from rbstab.experiment.simulate import simulate
from rbstab.integrate.engines import engine

ENGINES = ("scipy", "heyoka")
EACH = pytest.mark.parametrize("name", ENGINES)

STIFFNESS, DAMPING, MASS, PUSH = 40.0, 1.5, 2.0, 3.0
OSCILLATOR = {
    "variant": "free",
    "K_t": [STIFFNESS, 50, 60],
    "L_t": [DAMPING, 2, 3],
    "K_r": [4, 4, 4],
    "L_r": [1, 1, 1],
}
"""The body with a stabilizer: along x its centre of gravity is a linear oscillator."""


def motion_along_x(signal, name, **integration):
    data = driven({"push": force(signal)}, name, controller=OSCILLATOR, integration=integration)
    run = simulate(data)
    assert run.status == "completed"
    return run


@EACH
@pytest.mark.parametrize("kind", LEGS)
def test_an_oscillator_under_legs(kind, name):
    """mẍ + lẋ + kx = f s(t), leg by leg by matrix exponentials."""
    run = motion_along_x(LEGS[kind], name)
    M = np.array([[0.0, 1.0], [-STIFFNESS / MASS, -DAMPING / MASS]])
    signal = load_config(driven({"push": force(LEGS[kind])})).elements["push"].signal
    exact = linear_response(M, np.array([0.0, PUSH / MASS]), _legs(signal, 1.0), run["time"])
    simulated = np.column_stack([run["position"][:, 0], run["velocity"][:, 0]])
    assert np.abs(exact).max() > 0.01
    np.testing.assert_allclose(simulated, exact, atol=1e-12)
    np.testing.assert_array_equal(run["position"][:, 1:], 0)


@EACH
@pytest.mark.parametrize("kind", ["constant", "sine"])
def test_an_oscillator_under_a_smooth_signal(kind, name):
    """x = Im(H e^{iφ} (e^{iωt} - …)): the answer to e^{iωt} plus a free motion from rest."""
    w, phase = (2 * np.pi * SINE["frequency"], SINE["phase"]) if kind == "sine" else (0, np.pi / 2)
    run = motion_along_x(SIGNALS[kind], name)
    t = run["time"]
    H = PUSH / (STIFFNESS - MASS * w**2 + 1j * w * DAMPING)
    roots = np.roots([MASS, DAMPING, STIFFNESS]).astype(complex)
    free = np.linalg.solve(np.array([[1, 1], roots]), -H * np.array([1, 1j * w]))
    x = (np.exp(1j * phase) * (H * np.exp(1j * w * t) + free @ np.exp(np.outer(roots, t)))).imag
    np.testing.assert_allclose(run["position"][:, 0], x, atol=1e-12)


@EACH
def test_a_pulse_of_a_couple_gives_a_free_body_its_angular_momentum(name):
    """About the centre, inertial, it rises by load times duration."""
    pulse = LEGS["pulse"]
    push = couple(pulse)
    spin = {"angular_velocity": [0.5, -1.0, 2.0], "velocity": [1.0, 0.0, -2.0]}
    run = simulate(driven({"push": push}, name, initial=spin))
    turning = run["angular_velocity"] * [0.5, 0.7, 0.9]
    momentum = np.einsum("tij,tj->ti", run.rotation, turning)
    impulse = push["amplitude"] * pulse["duration"] * np.array(push["direction"]) / 3
    np.testing.assert_allclose(momentum[-1] - momentum[0], impulse, atol=1e-12)
    # Before the pulse nothing has happened.
    before = momentum[run["time"] < pulse["start"]]
    np.testing.assert_allclose(before, 0 * before + momentum[0], atol=1e-14)


def several(kinds):
    """Return one input of each signal, of all quantities in turn."""
    quantities = ("force", "body_force", "couple", "body_couple")
    elements = {}
    for number, kind in enumerate(kinds):
        quantity = quantities[number % 4]
        arm = {"point": [0.1, 0.2, -0.1], "direction": [1, -1, 2], "quantity": quantity}
        made = (
            force(SIGNALS[kind], **arm) if "force" in quantity else couple(SIGNALS[kind], quantity)
        )
        elements[f"input_{number}"] = made
    return elements


TIED = OSCILLATOR | {"variant": "visco-elastic", "K_c": [900, 700, 800], "L_c": [9, 8, 7]}
LIGAMENT = {
    "kind": "ligament",
    "point": [0, 0, 0],
    "anchor": [-0.7, 0, 0],
    "stiffness": 80.0,
    "slack_length": 0.71,
    "toe_strain": 0.01,
    "damping": 0.2,
}
GUARD = {"kind": "guard", "method": "stiff", "stiffness": 5.0, "soft_angle": 0.02}
VARIANTS: dict[str, Any] = {
    "none": {},
    "elements that switch": {
        "controller": OSCILLATOR,
        "elements": several(["pulse", "noise", "sine"]) | {"line": LIGAMENT, "range": GUARD},
    },
    "tied": {"controller": TIED, "gravity": [0, 0, -9.81]},
    "contact coordinates": {"controller": TIED, "integration": {"coordinates": "W"}},
    "held": {"controller": OSCILLATOR | {"variant": "permanent"}, "gravity": [0, 0, -9.81]},
    "manifold": {
        "controller": OSCILLATOR | {"variant": "permanent"},
        "integration": {"coordinates": "manifold"},
    },
}


@pytest.mark.heavy
@pytest.mark.parametrize("variant", VARIANTS)
def test_audit_and_engines(variant):
    """The audit is below 1e-12 of the energies, the engines agree to 1e-9, v' is ∇v·f."""
    sections = VARIANTS[variant] | {"initial": {"angular_velocity": [0.3, -0.2, 0.5]}}
    elements = sections.pop("elements", several(SIGNALS))
    runs = {}
    for name in ENGINES:
        run = runs[name] = simulate(driven(elements, name, **sections))
        size = max(np.abs(run["energy"]).max(), np.abs(run["supplied_energy"]).max())
        assert np.abs(run["energy_residual"]).max() < AUDIT * size
        # Under a constant force alone, as under a weight, nothing is at rest.
        assert run.attributes["verdict"] == ("unknown" if variant == "none" else "driven")
        verdicts = dict(zip(run["certificate/check"], run["certificate/verdict"], strict=True))
        assert verdicts.pop("decrease") == "driven"
        assert set(verdicts.values()) <= {"consistent", "unknown", "driven"}
        assert (
            verdicts["audit"] == verdicts["breakpoints"] == verdicts["derivative"] == "consistent"
        )
        balance = run["supplied_power"].sum(axis=1) - run["dissipation"].sum(axis=1)
        np.testing.assert_allclose(run["lyapunov_rate"], balance, rtol=1e-13, atol=1e-13)
    first, second = runs.values()
    for quantity in ("orientation", "angular_velocity", "position", "velocity", "supplied_energy"):
        np.testing.assert_allclose(first[quantity], second[quantity], atol=1e-9)


@EACH
def test_samples_at_a_breakpoint_show_what_begins_there(name):
    """The load of every sample is the signal: right-continuous at a jump, also with few samples."""
    for kind in ("pulse", "ramp", "table"):
        signal = LEGS[kind]
        run = motion_along_x(signal, name, samples=101)
        load = run["element_force"][:, 0, 0] / PUSH
        expected = value_at(signal, np.round(run["time"], 12))
        jumps = np.abs(np.subtract.outer(run["time"], [0.31, 0.51, 0.4])).min(axis=1) < 1e-9
        np.testing.assert_allclose(load[~jumps], expected[~jumps], atol=1e-12)
        assert jumps.any()
        # At a jump the two doubles of one time may differ in their last digit.
        for row in np.flatnonzero(jumps):
            near = value_at(signal, run["time"][row] + np.array([-1e-12, 1e-12]))
            assert np.abs(near - load[row]).min() < 1e-9


@EACH
def test_a_missed_breakpoint_is_seen_by_the_certificate_and_not_by_the_audit(name, monkeypatch):
    """An engine that never begins the next leg balances v, but for another signal."""
    from rbstab.integrate.problem import Problem

    data = driven({"push": force(LEGS["pulse"])}, name, controller=OSCILLATOR)
    whole = problem(data)
    with monkeypatch.context() as patched:
        patched.setattr(Problem, "breakpoints", lambda _: [])
        missed = engine(name)(whole)
    assert len(missed.breakpoints) == 0
    patched = lambda *_: missed  # noqa: E731
    monkeypatch.setattr("rbstab.experiment.simulate.engine", lambda _: patched)
    run = simulate(data)
    verdicts = dict(zip(run["certificate/check"], run["certificate/verdict"], strict=True))
    assert verdicts["breakpoints"] == "violated"
    assert run.attributes["verdict"] == "violated"
    values = dict(zip(run["certificate/check"], run["certificate/value"], strict=True))
    assert values["breakpoints"] == 2


@pytest.mark.parametrize(("size", "start"), [(1e4, 0.0), (1e-4, 300.0)])
def test_energies_of_any_size(size, start):
    """The compiled engine measures its errors in an energy; that of the start may not fit."""
    elements = {"push": force(LEGS["pulse"], amplitude=size)}
    sections = {"controller": OSCILLATOR, "initial": {"position": [start, 0, 0]}}
    first, second = (simulate(driven(elements, name, **sections)) for name in ENGINES)
    for run in (first, second):
        energy = max(np.abs(run["energy"]).max(), np.abs(run["supplied_energy"]).max())
        # Some move by hundreds of metres, and an error is relative to the largest state.
        assert np.abs(run["energy_residual"]).max() < 10 * AUDIT * energy
    farthest = np.abs(first["position"]).max()
    np.testing.assert_allclose(first["position"], second["position"], atol=1e-11 * farthest)
