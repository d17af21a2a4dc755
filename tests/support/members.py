"""Members of a sweep as single runs, for comparison."""

import numpy as np

from rbstab.config.build import problem_of
from rbstab.experiment.record import record_of
from rbstab.integrate.engines import engine
from rbstab.mechanics.attitude import rate_matrix
from rbstab.sweep.outcome import STATUSES, Traces, outcome_of


def outcome_alone(plan, index, name="heyoka"):
    """The outcome of one member, each column with one entry, by an engine for single runs."""
    problem = problem_of(plan.config_of(index))
    trajectory = engine(name)(problem)
    arrays = {key: v.data for key, v in record_of(problem, trajectory).variables.items()}
    pairs = zip(arrays["orientation"], arrays["angular_velocity"], strict=True)
    rate = np.array([rate_matrix(Theta) @ Omega for Theta, Omega in pairs])
    own = arrays.get("connector_state")
    traces = Traces(
        arrays["time"],
        arrays["orientation"][None],
        rate[None],
        arrays["angular_velocity"][None],
        arrays["position"][None],
        arrays["velocity"][None],
        arrays["contact_displacement"][None],
        arrays["contact_velocity"][None],
        None if own is None else own[None],
        arrays["lyapunov"][None],
        arrays["energy_residual"][None],
    )
    found = outcome_of(traces) if len(trajectory.times) > 1 else {}
    found["status"] = np.array([STATUSES.index(trajectory.status)])
    found["steps"] = np.array([trajectory.steps])
    return found
