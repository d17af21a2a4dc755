"""Warnings that follow from the motion at the start: an angle that winds up, a run without end."""

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from rbstab.analysis.configuration import configurations, without_inputs
from rbstab.elements.declarations import ANCHOR, POINT
from rbstab.elements.motors import Limited
from rbstab.elements.rotational_stabilizer import RotationalStabilizer
from rbstab.integrate.problem import Problem
from rbstab.mechanics.derivatives import jacobian
from rbstab.mechanics.numbers import Array
from rbstab.systems.system import System

NEGLIGIBLE = 0.01
"""A spring that stores less than this share of the energy of a spin in half a turn hardly acts."""

STEPS_PER_RADIAN = {"heyoka": 1.0, "DOP853": 2.0, "RK45": 20.0, "LSODA": 40.0, "Radau": 40.0}
"""Steps per radian of an oscillation, measured at rtol 1e-12; a run may need a third of them, or
three times as many."""

STEPS_PER_DECAY = 1 / 6
"""Steps per time constant of a motion that has decayed: explicit methods stay stable with these."""

IMPLICIT = ("LSODA", "Radau")
"""Methods whose steps grow once a fast motion has decayed."""

DECAYED = 30.0
"""After so many time constants nothing of a fast motion is left beside an error of 1e-12."""

MANY_STEPS = {"scipy": 1e5, "heyoka": 1e6}
"""Steps that take an engine about a minute."""


def start_warnings(problem: Problem, engine: str) -> list[str]:
    """Return the warnings about the motion at the start of a problem.

    Args:
        problem: The problem.
        engine: The name of the engine that integrates it.
    """
    with np.errstate(all="ignore"):
        return [*_winding_up(problem), *_too_fast(problem, engine)]


def _winding_up(problem: Problem) -> Iterator[str]:
    """Yield a warning for each angle that a spin winds up against a spring that hardly acts."""
    system = without_inputs(problem.system)
    springs: list[Any] = [
        element for element in system.elements if isinstance(element, RotationalStabilizer)
    ]
    springs = [element for element in springs if not isinstance(element, Limited)]
    motion = system.motion(problem.start)
    rates, to_body = motion.B @ motion.Omega, np.linalg.inv(motion.B)
    for spring in springs:
        for axis in (0, 2):
            stored = 0.5 * spring.K_r[axis, axis] * math.pi**2
            turn = to_body[:, axis] * rates[axis]
            spin = 0.5 * turn @ system.body.inertia @ turn
            if not 0 < stored < NEGLIGIBLE * spin:
                continue
            decay = turn @ spring.L_r @ turn / (2 * spin)
            angle = abs(rates[axis]) * min(problem.times[-1], 1 / decay)
            if angle > math.pi and spin > _climb(system, problem.start, axis):
                yield (
                    f"controller.K_r: the spin winds θ{axis + 1} up, and its spring pulls it back "
                    f"through all turns, although it stores only {stored:.2g} J in half a turn, "
                    f"beside {spin:.2g} J of the spin; if the body has no such spring, set K_r to "
                    "0 or leave it out"
                )


def _climb(system: System, start: Array, axis: int) -> float:
    """Return how far the stored energy rises in half a turn of an angle, J."""
    at_rest = configurations(system)
    q = at_rest.configuration(system.motion(start), start[system.coordinates.size :])
    turned = q + np.outer(np.linspace(0.0, math.pi, 9), np.eye(len(q))[axis])
    energies = [float(at_rest.energy(place)) for place in turned]
    return max(energies) - energies[0]


def _too_fast(problem: Problem, engine: str) -> Iterator[str]:
    """Yield a warning if the fastest motion makes the run hopeless."""
    method = problem.method if engine == "scipy" else engine
    values = _eigenvalues(problem.system, problem.start)
    duration, decay = problem.times[-1], np.abs(values.real)
    if method in IMPLICIT:
        waves, decays = np.abs(values.imag) * np.minimum(duration, DECAYED / decay), 0.0 * decay
    else:
        waves, decays = np.abs(values.imag) * duration, decay * duration
    steps = (waves * STEPS_PER_RADIAN[method] + decays * STEPS_PER_DECAY).max(initial=0.0)
    if steps > MANY_STEPS[engine]:
        yield (
            f"{_stiffest(problem)}: the fastest motion has a time scale of "
            f"{1 / np.abs(values).max():.2g} s, so {duration:g} s need about {steps:.1g} steps "
            f"with {method} (step_limit: {problem.step_limit:g}); is its unit right?"
        )


def _eigenvalues(system: System, start: Array) -> Array:
    """Return the eigenvalues of the motion linearised at the start, 1/s; none if it has kinks."""
    matrix = jacobian(system.rates, start)
    if not np.isfinite(matrix).all():
        return np.zeros(0, dtype=complex)
    return np.linalg.eigvals(matrix).astype(complex)


def _stiffest(problem: Problem) -> str:
    """Return the key of the gain whose half slows the fastest motion down most."""
    system, speeds = problem.system, {}
    for place, original in enumerate(system.elements):
        element: Any = original
        owner = f"elements.{element.name}" if "name" in vars(element) else "controller"
        for gain in element.gains:
            if gain in (POINT, ANCHOR):
                continue
            # Of a time constant it is the double.
            factor = 2.0 if gain.unit == "s" else 0.5
            less = replace(element, **{gain.name: factor * getattr(element, gain.name)})
            elements = (*system.elements[:place], less, *system.elements[place + 1 :])
            values = _eigenvalues(replace(system, elements=elements), problem.start)
            speeds[f"{owner}.{gain.place}"] = np.abs(values).max(initial=0.0)
    return min(speeds, key=speeds.__getitem__, default="body.mass")
