"""The quantities of `tune` and `sensitivities` from samples alone, and their finite differences."""

import copy
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import Chebyshev

from rbstab.analysis.rest_state import nearest_rest_state
from rbstab.analysis.rest_system import smooth_rest_system
from rbstab.config.build import problem_of
from rbstab.config.load import load_config
from support.problems import solve

STEP = 5e-4
"""Relative step of a changed number. The differences are of fourth order."""

HALF_WIDTH = 6e-3
"""s: the peaks of the perturbed runs stay this close to the peak of the given run."""


class Method(NamedTuple):
    """The relative step of a changed number, and the half width of the windows, s.

    A motion that switches needs both to be small: another step may meet another sequence of
    switches, and no polynomial fits a window with a switch in it.
    """

    step: float = STEP
    half_width: float = HALF_WIDTH


SMOOTH, SWITCHING = Method(), Method(2e-5, 2e-4)

POINTS = np.cos(np.pi * (np.arange(11) + 0.5) / 11)
"""Chebyshev points: they interpolate a motion of 50 rad/s to 1e-13 in a window."""


def quantities(data, near, method=SMOOTH):
    """Return the quantities of `near` for a config, searching extremes close to those of `near`."""
    problem = problem_of(load_config(data))
    system, end = problem.system, problem.times[-1]
    names = [quantity.name for quantity in near.quantities]
    hints = {
        n: t for n, t in zip(names, near.values, strict=True) if n.endswith("time") or "time[" in n
    }
    values: dict[str, Any] = {name: hint for name, hint in hints.items() if np.isnan(hint)}
    width = method.half_width
    windows = {n: _window(hint, end, width) for n, hint in hints.items() if n not in values}
    times = np.unique(np.concatenate([[0.0, end], *windows.values()]))
    trajectory = solve("heyoka", replace(problem, times=times, rtol=1e-16))
    impacts = np.zeros(0) if trajectory.impacts is None else trajectory.impacts.times
    if len(impacts):
        # A peak may be at an impact, which has no polynomial on both sides.
        windows = {name: _at_impact(window, impacts) for name, window in windows.items()}
        times = np.unique(np.concatenate([[0.0, end], *windows.values()]))
        trajectory = solve("heyoka", replace(problem, times=times, rtol=1e-16))
    assert trajectory.status == "completed"
    states = dict(zip(times, trajectory.states, strict=True))
    systems = dict(zip(times, trajectory.systems, strict=True))
    for axis in range(3):
        if f"peak_time[{axis}]" in windows:
            window = windows[f"peak_time[{axis}]"]
            motions = [system.motion(states[t]) for t in window]
            E, F = (np.array([getattr(m, name)[axis] for m in motions]) for name in "EF")
            t, peak = _peak(window, E, F)
            values |= {f"peak_time[{axis}]": t, f"peak_contact_displacement[{axis}]": peak}
    if "settling_time" in windows:
        rest = nearest_rest_state(smooth_rest_system(problem)).energy
        v = {t: systems[t].observe(y).energy.sum() - rest for t, y in states.items()}
        values["settling_time"] = _settling(windows["settling_time"], v)
    last = system.observe(states[end])
    motion = last.motion
    for name, value in (
        ("orientation", motion.Theta),
        ("angular_velocity", motion.Omega),
        ("position", motion.X),
        ("velocity", motion.V),
        ("connector_state", last.own_states),
    ):
        values |= {f"final.{name}[{axis}]": entry for axis, entry in enumerate(value)}
    return np.array([values[name] for name in names])


def differences(data, given, method=SMOOTH):
    """Return the derivatives of `given` by central differences of runs, shape (entries, m).

    Args:
        data: The config.
        given: Its sensitivities.
        method: The steps and the windows.
    """
    return np.array([_difference(data, entry, given, method) for entry in given.entries])


def _difference(data, entry, given, method):
    size, step = abs(entry.value) or 1.0, method.step

    def run(shift):
        changed = copy.deepcopy(data)
        for *path, last in entry.paths:
            parent: Any = changed
            for key in path:
                parent = parent[key]
            parent[last] = entry.value + shift * size
        return quantities(changed, given, method)

    near, far = run(step) - run(-step), run(2 * step) - run(-2 * step)
    return (8 * near - far) / (12 * step * size)


def _window(hint, end, half_width):
    # A peak at an end of the run stays at that end.
    return np.array([hint]) if hint in {0.0, end} else hint + half_width * POINTS


def _at_impact(window, impacts):
    """Return the impact in a window, or the window if there is none."""
    inside = impacts[(impacts > window.min()) & (impacts < window.max())]
    assert len(inside) < 2
    return inside if len(inside) else window


def _fitted(window, values):
    return Chebyshev.fit(window, values, len(window) - 1, domain=_domain(window))


def _domain(window):
    middle, half_width = window.mean(), np.ptp(window) / np.ptp(POINTS)
    return middle - half_width, middle + half_width


def _root(window, curve):
    low, high = _domain(window)
    roots: np.ndarray = np.array([complex(root) for root in curve.roots()])
    real = roots[np.abs(roots.imag) < 1e-9].real
    (root,) = real[(real > low) & (real < high)].tolist()
    return float(root)


def _peak(window, E, F):
    if len(window) == 1:
        return float(window[0]), float(E[0])
    turning = _root(window, _fitted(window, F))
    return turning, float(_fitted(window, E)(turning))


def _settling(window, value):
    if len(window) == 1:
        return float(window[0])
    return _root(window, _fitted(window, np.log([value[t] / (1e-3 * value[0.0]) for t in window])))
