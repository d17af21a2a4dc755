"""The record of a run: its trajectory as named arrays, with its certificate."""

import math
from typing import NamedTuple

import numpy as np

from rbstab.analysis.certificate import Check
from rbstab.analysis.lyapunov import lyapunov_trace
from rbstab.analysis.rest_state import nearest_rest_state
from rbstab.experiment.run_certificate import certificate_of
from rbstab.experiment.switching_record import (
    has_no_potential,
    smooth_rest_system,
    switching_arrays,
)
from rbstab.integrate.problem import Problem, Trajectory
from rbstab.mechanics.numbers import Array
from rbstab.store.result import Variable
from rbstab.systems.quantities import BY_NAME, RUN_DIMENSIONS
from rbstab.systems.system import Observation, System


class Record(NamedTuple):
    """The stored data of a run.

    Attributes:
        variables: The arrays by their names in `QUANTITIES`, and the coordinates of their
            dimensions.
        checks: The checks of the certificate that need no proof.
        warnings: Warnings about the rest state.
    """

    variables: dict[str, Variable]
    checks: list[Check]
    warnings: list[str]


def record_of(problem: Problem, trajectory: Trajectory) -> Record:
    """Return all quantities of a run along its trajectory, and its certificate."""
    with np.errstate(all="ignore"):
        rest = nearest_rest_state(smooth_rest_system(problem))
        arrays = quantities_of(problem, trajectory, rest.energy)
        checks = certificate_of(problem, trajectory, arrays)
    parts = np.array(problem.system.parts, dtype=object)
    coordinates = {
        name: Variable((name,), np.arange(1, len(arrays[source]) + 1), "1", f"number of the {name}")
        for name, source in (("switch", "switch_time"), ("transition", "transition_time"))
        if source in arrays
    } | {
        **{
            name: Variable((name,), np.arange(1, length + 1), "1", "component of a vector")
            for name, length in RUN_DIMENSIONS.items()
            if any(name in BY_NAME[array].dimensions for array in arrays)
        },
        "part": Variable(("part",), parts, "1", "part of the system"),
    }
    described = {name: _variable(name, arrays[name]) for name in BY_NAME if name in arrays}
    warnings = [] if rest.found else ["no rest state was found in the range of eq. 5"]
    return Record(coordinates | described, checks, warnings)


def quantities_of(
    problem: Problem, trajectory: Trajectory, energy_at_rest: float
) -> dict[str, Array]:
    """Return all quantities of a run along its trajectory, by their names in `QUANTITIES`.

    Args:
        problem: The initial value problem.
        trajectory: The trajectory.
        energy_at_rest: The stored energy of the rest state, J; v is zero there.
    """
    system = problem.system
    # Overflow is the result of a diverged run, not an error.
    with np.errstate(all="ignore"):
        systems = trajectory.systems or (system,) * len(trajectory.times)
        observations = [s.observe(y) for s, y in zip(systems, trajectory.states, strict=True)]
        arrays = {
            "time": trajectory.times,
            **_arrays(system, trajectory.states, observations),
        }
        change = trajectory.lyapunov_change
        if trajectory.switches is not None:
            arrays |= switching_arrays(trajectory.switches)
            change = change - trajectory.switches.discarded_energy
        if has_no_potential(system):
            # The contact force has no potential, so v - ε replaces v (eq. 28).
            arrays["energy"][:, system.parts.index("connector")] = -trajectory.contact_work
        trace = lyapunov_trace(arrays["energy"], arrays["dissipation"], change, energy_at_rest)
    return arrays | {
        "lyapunov": trace.value,
        "lyapunov_rate": trace.rate,
        "lyapunov_change": trajectory.lyapunov_change,
        "energy_residual": trace.residual,
        "contact_work": trajectory.contact_work,
        "energy_at_rest": np.array(energy_at_rest),
    }


def motion_warnings(trajectory: Trajectory) -> list[str]:
    """Return a warning if θ1 or θ3 leaves the range of eq. 5; no equation becomes singular then."""
    warnings = []
    for index, name in ((0, "θ1"), (2, "θ3")):
        outside = np.abs(trajectory.states[:, index]) > math.pi
        if outside.any():
            t = trajectory.times[int(outside.argmax())]
            warnings.append(f"{name} is outside [-π, π], the range of eq. 5, from t = {t:.6g} s")
    return warnings


def _arrays(system: System, states: Array, observations: list[Observation]) -> dict[str, Array]:
    motions = [observation.motion for observation in observations]
    names = [element.name for element in system.elements]
    H, N = names.index("translational stabilizer"), names.index("rotational stabilizer")
    arrays = {
        "orientation": np.array([motion.Theta for motion in motions]),
        "angular_velocity": np.array([motion.Omega for motion in motions]),
        "position": np.array([motion.X for motion in motions]),
        "velocity": np.array([motion.V for motion in motions]),
        "contact_displacement": np.array([motion.E for motion in motions]),
        "contact_velocity": np.array([motion.F for motion in motions]),
        "contact_force": np.array([o.contact_force for o in observations]),
        "stabilizing_force": np.array([o.wrenches[H].force for o in observations]),
        "stabilizing_couple": np.array([o.wrenches[N].couple for o in observations]),
        "energy": np.array([o.energy for o in observations]),
        "dissipation": np.array([o.dissipation for o in observations]),
    }
    for name, indices in system.own_states.items():
        arrays[name] = states[:, indices]
    if system.coordinates.name == "manifold":
        for level, source in (("position", "displacement"), ("velocity", "velocity")):
            residual = np.linalg.norm(arrays[f"contact_{source}"], axis=1)
            arrays[f"constraint_{level}_residual"] = residual
    return arrays


def _variable(name: str, data: Array) -> Variable:
    quantity = BY_NAME[name]
    long_name = f"{quantity.symbol}: {quantity.meaning}"
    return Variable(quantity.dimensions, data, quantity.unit, long_name)
