"""The quantities of `tune` and `sensitivities` from samples alone, and their finite differences."""

import copy
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.polynomial import Chebyshev

from rbstab.analysis.rest_state import nearest_rest_state
from rbstab.config.build import problem_of
from rbstab.config.entries import Entry
from rbstab.config.load import load_config
from rbstab.experiment.tuning.sensitivities import Sensitivities
from support.problems import solve

STEP = 5e-4
"""Relative step of a changed number. The differences are of fourth order."""

HALF_WIDTH = 6e-3
"""s: the peaks of the perturbed runs stay this close to the peak of the given run."""

POINTS = np.cos(np.pi * (np.arange(11) + 0.5) / 11)
"""Chebyshev points: they interpolate a motion of 50 rad/s to 1e-13 in a window."""


def quantities(data: dict[str, Any], near: Sensitivities) -> np.ndarray:
    """Return the quantities of `near` for a config, searching extremes close to those of `near`."""
    problem = problem_of(load_config(data))
    system, end = problem.system, problem.times[-1]
    names = [quantity.name for quantity in near.quantities]
    hints = {
        n: t for n, t in zip(names, near.values, strict=True) if n.endswith("time") or "time[" in n
    }
    windows = {name: _window(hint, end) for name, hint in hints.items()}
    times = np.unique(np.concatenate([[0.0, end], *windows.values()]))
    trajectory = solve("heyoka", replace(problem, times=times, rtol=1e-16))
    assert trajectory.status == "completed"
    states = dict(zip(times, trajectory.states, strict=True))
    found: dict[str, Any] = {}
    for axis in range(3):
        if f"peak_time[{axis}]" in windows:
            window = windows[f"peak_time[{axis}]"]
            E = [system.motion(states[t]).E[axis] for t in window]
            t, peak = _peak(window, np.array(E))
            found |= {f"peak_time[{axis}]": t, f"peak_contact_displacement[{axis}]": peak}
    if "settling_time" in windows:
        found["settling_time"] = _settling(system, windows["settling_time"], states)
    last = system.observe(states[end])
    motion = last.motion
    for name, value in (
        ("orientation", motion.Theta),
        ("angular_velocity", motion.Omega),
        ("position", motion.X),
        ("velocity", motion.V),
        ("connector_state", last.own_states),
    ):
        found |= {f"final.{name}[{axis}]": entry for axis, entry in enumerate(value)}
    return np.array([found[name] for name in names])


def differences(data: dict[str, Any], given: Sensitivities) -> np.ndarray:
    """Return the derivatives of `given` by central differences of runs, shape (entries, m)."""
    return np.array([_difference(data, entry, given) for entry in given.entries])


def _difference(data: dict[str, Any], entry: Entry, given: Sensitivities) -> np.ndarray:
    size = abs(entry.value) or 1.0

    def run(shift: float) -> np.ndarray:
        changed = copy.deepcopy(data)
        for *path, last in entry.paths:
            parent: Any = changed
            for key in path:
                parent = parent[key]
            parent[last] = entry.value + shift * size
        return quantities(changed, given)

    near, far = run(STEP) - run(-STEP), run(2 * STEP) - run(-2 * STEP)
    return (8 * near - far) / (12 * STEP * size)


def _window(hint: float, end: float) -> np.ndarray:
    # A peak at an end of the run stays at that end.
    return np.array([hint]) if hint in {0.0, end} else hint + HALF_WIDTH * POINTS


def _fitted(window: np.ndarray, values: np.ndarray) -> Chebyshev:
    middle = window.mean()
    domain = (middle - HALF_WIDTH, middle + HALF_WIDTH)
    return Chebyshev.fit(window, values, len(window) - 1, domain=domain)


def _peak(window: np.ndarray, values: np.ndarray) -> tuple[float, float]:
    if len(window) == 1:
        return float(window[0]), float(values[0])
    curve = _fitted(window, values)
    turning = [z.real for z in curve.deriv().roots() if abs(z.imag) < 1e-9]
    inside = [t for t in turning if abs(t - window.mean()) < HALF_WIDTH]
    assert len(inside) == 1
    return float(inside[0]), float(curve(inside[0]))


def _settling(system: Any, window: np.ndarray, states: dict[float, np.ndarray]) -> float:
    rest = nearest_rest_state(system).energy
    value = {t: system.observe(y).energy.sum() - rest for t, y in states.items()}
    curve = _fitted(window, np.log([value[t] / (1e-3 * value[0.0]) for t in window]))
    (root,) = [
        z.real
        for z in curve.roots()
        if abs(z.imag) < 1e-9 and abs(z.real - window.mean()) < HALF_WIDTH
    ]
    return float(root)
