"""Bodies with a stop, a constant load on θ2, and closed forms of their motions."""

from dataclasses import dataclass, replace

import numpy as np

from rbstab.elements.element import Element, couple_on_body
from rbstab.integrate.engines import engine
from rbstab.integrate.problem import Problem
from rbstab.mechanics.numbers import Number
from rbstab.mechanics.states import PITCH
from support.switching import TIGHT, data, problem

ANGLE = 0.3


@dataclass(frozen=True, eq=False, kw_only=True)
class Drive(Element):
    """A constant couple on θ2, towards larger angles.

    Args:
        couple: N m.
    """

    name: str = "drive"
    couple: Number

    def wrench(self, motion, states):
        """Return the couple, by the second row of B."""
        return couple_on_body(self.couple * motion.B[PITCH])

    def stored(self, motion, states):
        """Return the energy -cθ2, J."""
        return -self.couple * motion.Theta[PITCH]


def stop(restitution=0.5, angle=ANGLE):
    """Return a stop."""
    return {"kind": "guard", "method": "stop", "angle": angle, "restitution": restitution}


def stopped(restitution, spin, **integration):
    """Return a body that turns about its second principal axis, between two stops."""
    return data({"end": stop(restitution)}, {"angular_velocity": [0, spin, 0]}, integration)


def pressed(config, engine_name, couple, **integration):
    """Return the problem of plain data for an engine, with a `Drive`."""
    settings = config["integration"] | TIGHT[engine_name] | {"engine": engine_name} | integration
    given: Problem = problem(config | {"integration": settings})
    elements = (*given.system.elements, Drive(couple=couple))
    return replace(given, system=replace(given.system, elements=elements))


def solution(given, engine_name):
    """Return the trajectory of a problem by an engine."""
    return engine(engine_name)(given)


def energies(trajectory):
    """Return the sum of all energies at each sample, J."""
    pairs = zip(trajectory.systems, trajectory.states, strict=True)
    return np.array([system.observe(y).energy.sum() for system, y in pairs])


def residual(trajectory):
    """Return the largest |v(t) - v(0) - ∫v' dt + what impacts took away|, J."""
    v = energies(trajectory)
    assert trajectory.impacts is not None
    return float(np.abs(v - v[0] - trajectory.lyapunov_change + trajectory.impacts.lost).max())


def couple_of(system, y):
    """Return the couple τ on θ2 by which the stop holds a body."""
    (place,) = [i for i, element in enumerate(system.elements) if element.holds]
    observed = system.observe(y)
    couple = observed.wrenches[place].couple
    # N'Ω = (B⁻ᵀN)'Θ̇
    return float((np.linalg.inv(observed.motion.B).T @ couple)[PITCH])
