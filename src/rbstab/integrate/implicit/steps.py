"""One step of the implicit law, which takes the sign at the end of the step.

A step is backward Euler for the connector, Λ ∈ -K_s Sgn(s⁺), and explicit Euler for the smooth
forces. If a force within the bounds ±K_s can hold an axis on the surface, the step ends there, so
there is no chatter. But the step loses the energy of the chatter, and with s = E the time of
sticking depends on the step.

Source: V. Acary, B. Brogliato, Systems & Control Letters 59 (2010) 284-293.
"""

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from rbstab.integrate.implicit.axis_modes import Modes, system_for_modes
from rbstab.integrate.straight_line.equations import StraightLine
from rbstab.mechanics.numbers import Array, Number
from rbstab.mechanics.states import BODY, E_OF_W, F_OF_W, OMEGA, THETA
from rbstab.systems.connector import connector_of
from rbstab.systems.coordinates import PartlyHeldCoordinates
from rbstab.systems.system import AUDIT_SIZE, CONTACT_WORK, LYAPUNOV_CHANGE, System


class StepResult(NamedTuple):
    """The result of a step in given modes: audited state, and s⁺ and Λ by axis."""

    state: Array
    surface: Array
    force: Array


class Stepper(Protocol):
    """The interface of a function that makes one step in given modes."""

    def __call__(self, y: Array, modes: Modes, h: float) -> StepResult:
        """Make a step of length h from an audited state in coordinates W."""
        ...


def system_for_step(system: System, modes: Modes, h: Number) -> System:
    """Return the system whose held axes reach s⁺ = ρF⁺ + κE⁺ = 0 in one step.

    With F⁺ = F + hḞ and E⁺ = E + hF⁺ this means Ḟ = -F/h - κE/(h(ρ + κh)).
    """
    connector = connector_of(system)
    smooth_system = system_for_modes(system, modes)
    gain = connector.slope / (h * (connector.rate_weight + connector.slope * h))
    coordinates = PartlyHeldCoordinates(np.array(modes.held), 1.0 / h, gain)
    return System(smooth_system.body, smooth_system.elements, coordinates, smooth_system.anchor)


def step(system: System, y: Array, h: Number) -> StepResult:
    """Make one step of a system from `system_for_step`, for any kind of number.

    The velocities are stepped first, then Θ⁺ = Θ + hB(Θ)Ω⁺ and E⁺ = E + hF⁺. The work of Λ is exact
    for the step, h½(F + F⁺)'Λ. ∫v' uses the mean of the old and new velocities.
    """
    rates, force = system.audited_rates(y), system.observe(y).contact_force
    Omega, F = y[OMEGA] + h * rates[OMEGA], y[F_OF_W] + h * rates[F_OF_W]
    E = y[E_OF_W] + h * F
    Theta = y[THETA] + h * (system.motion(y).B @ Omega)
    midpoint = np.concatenate(
        [y[THETA], 0.5 * (y[OMEGA] + Omega), y[E_OF_W], 0.5 * (y[F_OF_W] + F), y[BODY.stop :]]
    )
    lyapunov = y[LYAPUNOV_CHANGE] + h * system.audited_rates(midpoint)[LYAPUNOV_CHANGE]
    work = y[CONTACT_WORK] + h * (midpoint[F_OF_W] @ force)
    state = np.concatenate([Theta, Omega, E, F, np.array([lyapunov, work])])
    return StepResult(state, connector_of(system).surface(E, F), force)


@dataclass(frozen=True)
class _StepInModes:
    """The step in given modes, as a function of a system and of a vector: the state, then h."""

    modes: Modes

    def __call__(self, system: System, x: Array) -> Array:
        """Return the state, s⁺ and Λ, one after the other."""
        y, h = x[:-1], x[-1]
        return np.concatenate(step(system_for_step(system, self.modes, h), y, h))


def python_stepper(system: System) -> Stepper:
    """Return a stepper in Python, without heyoka."""
    size = system.size + AUDIT_SIZE
    steps: dict[Modes, StraightLine] = {}

    def stepper(y: Array, modes: Modes, h: float) -> StepResult:
        if modes not in steps:
            steps[modes] = StraightLine(_StepInModes(modes), system, size + 1)
        value = steps[modes](np.append(y, h))
        return StepResult(value[:size], value[size : size + 3], value[size + 3 :])

    return stepper
