"""A trajectory as named arrays: what each sample means."""

import math

import numpy as np

from rbstab.analysis.lyapunov import lyapunov_trace
from rbstab.analysis.rest_state import nearest_rest_state
from rbstab.integrate.problem import Problem, Trajectory
from rbstab.mechanics.numbers import Array
from rbstab.store.result import Variable
from rbstab.systems.quantities import BY_NAME
from rbstab.systems.system import Observation, System


def variables_of(problem: Problem, trajectory: Trajectory) -> tuple[dict[str, Variable], list[str]]:
    """Every quantity of a run along its trajectory, and what is odd about its rest state.

    Returns:
        The arrays by their names in `QUANTITIES`, with the coordinates of their dimensions; and
        warnings.
    """
    system = problem.system
    # A diverged run ends where its numbers do: overflow is its result, not a fault.
    with np.errstate(all="ignore"):
        observations = [system.observe(state) for state in trajectory.states]
        rest = nearest_rest_state(system)
        arrays = {"time": trajectory.times, **_arrays(system, observations)}
        trace = lyapunov_trace(
            arrays["energy"], arrays["dissipation"], trajectory.lyapunov_change, rest.energy
        )
        arrays |= {
            "lyapunov": trace.value,
            "lyapunov_rate": trace.rate,
            "lyapunov_change": trajectory.lyapunov_change,
            "energy_residual": trace.residual,
            "contact_work": trajectory.contact_work,
            "energy_at_rest": np.array(rest.energy),
        }
    coordinates = {
        "axis": Variable(("axis",), np.array([1, 2, 3]), "1", "component of a vector"),
        "part": Variable(
            ("part",), np.array(system.parts, dtype=object), "1", "part of the system"
        ),
    }
    described = {name: _variable(name, arrays[name]) for name in BY_NAME if name in arrays}
    warnings = [] if rest.found else ["no rest state was found in the range of eq. 5"]
    return coordinates | described, warnings


def odd_of_motion(trajectory: Trajectory) -> list[str]:
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
