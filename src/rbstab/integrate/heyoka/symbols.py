"""Systems as heyoka expressions, with symbols for states and parameters."""

from collections.abc import Callable
from typing import Any

import heyoka as hy
import numpy as np

from rbstab.integrate.problem import Problem, Trajectory
from rbstab.mechanics.numbers import FUNCTIONS, Array, square
from rbstab.systems.modes import mode_parameters
from rbstab.systems.parameters import map_parameters, parameters
from rbstab.systems.system import System

for _name, _of in FUNCTIONS.items():
    _of.register(hy.expression, getattr(hy, _name))
# Its Taylor coefficients cost half of those of x * x. They are exact at x = 0 too.
square.register(hy.expression, lambda x: x**2.0)

# Do not log failures such as a step that is NaN: they become statuses.
hy.set_logger_level_critical()


def symbols_of(
    system: System, symbol_of: Callable[[int], Any] = hy.par.__getitem__
) -> tuple[System, dict[str, int], int]:
    """Return a system whose parameters are symbols, by default `par[]`.

    Args:
        system: Any system of the structure.
        symbol_of: Returns the symbol of a parameter, given its index.

    Returns:
        The symbolic system, the index of each parameter's first symbol, and the number of symbols.
    """
    offsets: dict[str, int] = {}
    count = 0

    def symbol(name: str, value: Array) -> Array:
        nonlocal count
        offsets[name] = count
        symbols = [symbol_of(count + k) for k in range(value.size)]
        count += value.size
        return np.array(symbols, dtype=object).reshape(value.shape)

    return map_parameters(system, symbol), offsets, count


MATRIX = 2
"""The dimensions of a matrix."""


def compiled_zeros(system: System) -> tuple[int, ...]:
    """Return the indices of the parameters that are compiled in as zeros.

    They are the zeros off the diagonals of all matrices, and the zeros in vectors of the elements
    of a config. So diagonal gains, a diagonal inertia and points on an axis need fewer products,
    but systems with other zeros are compiled again. Modes are no such zeros, because they change
    during a run. Vectors of the body and the controller stay open, and so do single numbers.
    """
    names = {element.name for element in system.elements if "name" in vars(element)}
    modes = mode_parameters(system)
    indices: list[int] = []
    count = 0
    for name, value in parameters(system).items():
        of_config = name.partition(".")[0] in names
        if value.ndim == MATRIX or (of_config and value.ndim and name not in modes):
            zeros = value == 0.0
            if not of_config:
                # A zero on a diagonal is a zero of this system, and not of its structure.
                np.fill_diagonal(zeros, val=False)
            indices += (count + np.flatnonzero(zeros)).tolist()
        count += value.size
    return tuple(indices)


def state_symbols(size: int) -> Array:
    """Return the symbols of a state vector."""
    return np.array([hy.expression(f"y{k}") for k in range(size)], dtype=object)


def parameter_values(system: System) -> Array:
    """Return the parameter values of a system, in the order of the symbols of `symbols_of`."""
    return np.concatenate([np.ravel(value) for value in parameters(system).values()])


def parameters_and_start(system: System, start: Array) -> Array:
    """Return the numbers that define a member: its parameters, then its initial state."""
    return np.concatenate([parameter_values(system), start])


def set_parameters(integrator: Any, values: Array) -> None:
    """Set the `par[]` of an integrator to the values of all parameters of its equations."""
    # heyoka has no `par[]` after the last one that the equations use.
    integrator.pars[:] = values[: len(integrator.pars)]


def set_motion(integrator: Any, time: float, state: Array) -> None:
    """Set the time and the state of an integrator; it forgets the events before.

    heyoka takes an event soon after the last one of its function for the same event.

    Args:
        integrator: heyoka's integrator.
        time: The time, s.
        state: The state.
    """
    integrator.time = time
    set_state(integrator, state)


def set_state(integrator: Any, state: Array) -> None:
    """Set the state of an integrator at its time; see `set_motion`."""
    integrator.state[:] = state
    integrator.reset_cooldowns()


def scaled_audit(rates: Array, size: int, scale: Any) -> Array:
    """Return audited rates in which the rates of the audit states are divided by an energy scale.

    Args:
        rates: The audited rates.
        size: The number of states; audit states follow them.
        scale: The energy scale, J.

    heyoka measures its error relative to the largest state. Audit states are energies and grow with
    the mass of the body. Unscaled, they would hide the error of the motion.
    """
    return np.concatenate([rates[:size], rates[size:] / scale])


LARGEST_MISFIT = 100.0
"""The largest ratio of an energy scale to the energies of a run that needs no other scale."""


def fitting_scale(problem: Problem, trajectory: Trajectory, scale: float) -> float:
    """Return the energy scale that fits a run, J; the given one if that fits.

    The energies at the start do not tell how much the elements will supply.

    Args:
        problem: The problem.
        trajectory: The run with the given scale.
        scale: The given scale, J.
    """
    if trajectory.supplied_energy is None:
        return scale
    audits = np.abs([trajectory.supplied_energy, trajectory.lyapunov_change])
    return float(fitting_scales(_initial_energy(problem) + audits.max(), scale))


def fitting_scales(sizes: Any, scales: Any) -> Array:
    """Return the scales that fit the energies of runs, J; the given ones where those fit."""
    misfits = (sizes > LARGEST_MISFIT * scales) | (sizes < scales / LARGEST_MISFIT)
    return np.where(misfits & (sizes > 0) & np.isfinite(sizes), sizes, scales)


def energy_scale(problem: Problem) -> float:
    """Return the sum of the absolute energies at the start, J; 1 J if it is zero or not finite."""
    return float(scales_of(_initial_energy(problem)))


def scales_of(sizes: Any) -> Array:
    """Return the energy scales of sums of energies, J; 1 J where one is zero or not finite."""
    return np.where((sizes > 0) & (sizes < np.inf), sizes, 1.0)


def _initial_energy(problem: Problem) -> float:
    """Return the sum of the absolute energies at the start, J."""
    with np.errstate(all="ignore"):
        return float(np.abs(problem.system.observe(problem.start).energy).sum())
