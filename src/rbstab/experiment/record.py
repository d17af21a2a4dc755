"""A trajectory as named arrays: what each sample means."""

import math
from typing import NamedTuple

import numpy as np

from rbstab.analysis.certificate import Check
from rbstab.analysis.lyapunov import lyapunov_trace
from rbstab.analysis.rest_state import nearest_rest_state
from rbstab.experiment.certified import certificate_of
from rbstab.experiment.switching_record import (
    resting_system,
    switching_arrays,
    works_without_potential,
)
from rbstab.integrate.problem import Problem, Trajectory
from rbstab.mechanics.numbers import Array
from rbstab.store.result import Variable
from rbstab.systems.quantities import BY_NAME
from rbstab.systems.system import Observation, System


class Record(NamedTuple):
    """What is stored of a run.

    variables are the arrays by their names in `QUANTITIES`, with the coordinates of their
    dimensions; checks are the lines of the certificate that the run decides by itself; warnings say
    what is odd about the rest state.
    """

    variables: dict[str, Variable]
    checks: list[Check]
    warnings: list[str]


def record_of(problem: Problem, trajectory: Trajectory) -> Record:
    """Every quantity of a run along its trajectory, and its certificate."""
    with np.errstate(all="ignore"):
        rest = nearest_rest_state(resting_system(problem))
        arrays = quantities_of(problem, trajectory, rest.energy)
        checks = certificate_of(problem, trajectory, arrays)
    parts = np.array(problem.system.parts, dtype=object)
    coordinates = {
        name: Variable((name,), np.arange(1, len(arrays[source]) + 1), "1", f"number of the {name}")
        for name, source in (("switch", "switch_time"), ("transition", "transition_time"))
        if source in arrays
    } | {
        "axis": Variable(("axis",), np.array([1, 2, 3]), "1", "component of a vector"),
        "part": Variable(("part",), parts, "1", "part of the system"),
    }
    described = {name: _variable(name, arrays[name]) for name in BY_NAME if name in arrays}
    warnings = [] if rest.found else ["no rest state was found in the range of eq. 5"]
    return Record(coordinates | described, checks, warnings)


def quantities_of(
    problem: Problem, trajectory: Trajectory, energy_at_rest: float
) -> dict[str, Array]:
    """Every quantity of a run along its trajectory, by its name in `QUANTITIES`.

    Args:
        problem: What was integrated.
        trajectory: The motion.
        energy_at_rest: What the elements store at rest, J, from which v counts.
    """
    system = problem.system
    # A diverged run ends where its numbers do: overflow is its result, not a fault.
    with np.errstate(all="ignore"):
        systems = trajectory.systems or (system,) * len(trajectory.times)
        observations = [s.observe(y) for s, y in zip(systems, trajectory.states, strict=True)]
        arrays = {"time": trajectory.times, **_arrays(system, observations)}
        change = trajectory.lyapunov_change
        if trajectory.switches is not None:
            arrays |= switching_arrays(trajectory.switches)
            change = change - trajectory.switches.discarded_energy
        if works_without_potential(system):
            # Where no energy is stored against the work of the contact force, v - ε takes the place
            # of v (eq. 28).
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
    """Where θ1 or θ3 leave the range of eq. 5, which no equation notices."""
    found = []
    for index, name in ((0, "θ1"), (2, "θ3")):
        outside = np.abs(trajectory.states[:, index]) > math.pi
        if outside.any():
            t = trajectory.times[int(outside.argmax())]
            found.append(f"{name} is outside [-π, π], the range of eq. 5, from t = {t:.6g} s")
    return found


def _arrays(system: System, observations: list[Observation]) -> dict[str, Array]:
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
    if system.size > system.coordinates.size:
        arrays["connector_state"] = np.array([o.connector_state for o in observations])
    if system.coordinates.name == "manifold":
        for level, source in (("position", "displacement"), ("velocity", "velocity")):
            residual = np.linalg.norm(arrays[f"contact_{source}"], axis=1)
            arrays[f"constraint_{level}_residual"] = residual
    return arrays


def _variable(name: str, data: Array) -> Variable:
    quantity = BY_NAME[name]
    long_name = f"{quantity.symbol}: {quantity.meaning}"
    return Variable(quantity.dimensions, data, quantity.unit, long_name)
