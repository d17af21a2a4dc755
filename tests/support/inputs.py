"""Inputs of configs, and their motions in closed form."""

from typing import Any

import numpy as np
from scipy.linalg import expm

from rbstab.config.build import problem_of
from rbstab.config.load import load_config

AUDIT = 1e-12
"""The largest residual of a run, relative to its energies."""

SINE: dict[str, Any] = {"kind": "sine", "frequency": 0.7, "phase": 0.4}
LEGS: dict[str, dict[str, Any]] = {
    "pulse": {"kind": "pulse", "start": 0.31, "duration": 0.2},
    "ramp": {"kind": "ramp", "start": 0.15, "duration": 0.5},
    "table": {"kind": "table", "times": [0.1, 0.4, 0.4, 0.9], "values": [0.5, -1.0, 1.0, 0.25]},
    "noise": {"kind": "noise", "seed": 4, "rate": 10.0, "correlation_time": 0.3},
}
"""A signal of each kind that is made of legs."""

SIGNALS: dict[str, dict[str, Any]] = {"constant": {"kind": "constant"}, "sine": SINE} | LEGS
"""A signal of each kind."""


def force(signal, **changes):
    """Return a force of 3 N along x at the centre of gravity."""
    return {
        "kind": "input",
        "quantity": "force",
        "point": [0, 0, 0],
        "direction": [2, 0, 0],
        "amplitude": 3.0,
        "signal": signal,
    } | changes


def couple(signal, quantity="couple", **changes):
    """Return a couple of 2 N m about no axis of symmetry."""
    return {
        "kind": "input",
        "quantity": quantity,
        "direction": [1, -2, 2],
        "amplitude": 2.0,
        "signal": signal,
    } | changes


def driven(elements, engine="scipy", **sections):
    """Return the plain data of a config with inputs, and with no controller by default."""
    integration = {"duration": 1.0, "samples": 21, "engine": engine}
    return {
        "schema_version": 2,
        "body": {"mass": 2.0, "inertia": [0.5, 0.7, 0.9], "contact_point": [0.1, -0.1, 0.2]},
        "elements": elements,
        "integration": integration | sections.pop("integration", {}),
    } | sections


def problem(data):
    """Return the problem of plain data."""
    return problem_of(load_config(data))


def value_at(signal, t):
    """Return a signal that is given by a formula or by a table, by other means than legs.

    At a jump it is the value after it.
    """
    if signal["kind"] == "constant":
        return np.ones_like(t)
    if signal["kind"] == "sine":
        return np.sin(2 * np.pi * signal["frequency"] * t + signal["phase"])
    if signal["kind"] == "pulse":
        return ((t >= signal["start"]) & (t < signal["start"] + signal["duration"])).astype(float)
    if signal["kind"] == "ramp":
        return np.clip((t - signal["start"]) / signal["duration"], 0, 1)
    # np.interp takes the last of two values at one time.
    return np.interp(t, signal["times"], signal["values"])


def linear_response(rates, push, legs, times):
    """Return the states of ẏ = My + p s(t) from rest, for a signal of legs, by matrix exponentials.

    Args:
        rates: M, shape (n, n).
        push: p, shape (n,).
        legs: The legs of s, shape (legs, 3): level, slope and beginning.
        times: The samples, from 0 on, shape (m,), s.
    """
    size = len(push)
    augmented = np.zeros((size + 2, size + 2))
    augmented[:size, :size], augmented[:size, size], augmented[size, size + 1] = rates, push, 1.0

    def moved(y, begin, end):
        level, slope, start = legs[int(np.searchsorted(legs[1:, 2], begin, side="right"))]
        s = np.array([level + slope * (begin - start), slope])
        return (expm(augmented * (end - begin)) @ np.concatenate([y, s]))[:size]

    y, t, states = np.zeros(size), 0.0, []
    for end in times.tolist():
        for stop in [*legs[(legs[:, 2] > t) & (legs[:, 2] < end), 2].tolist(), end]:
            y, t = moved(y, t, stop), stop
        states.append(y)
    return np.array(states)
