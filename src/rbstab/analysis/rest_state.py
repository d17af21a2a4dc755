"""The rest state from which the Lyapunov function is counted."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np

from rbstab.analysis.configuration import Configurations, configurations
from rbstab.mechanics.attitude import regularity
from rbstab.mechanics.derivatives import jacobian
from rbstab.mechanics.motion import Motion
from rbstab.mechanics.numbers import Array
from rbstab.systems.system import System

GRADIENT_TOLERANCE = 1e-7
"""N m and N: the energy is wrong by the square of the gradient over a stiffness, so this leaves it
exact to round-off for every stiffness above 1e-6."""

MAX_STEPS = 100
"""Steps of the descent: it takes some ten where there is a rest state to be found."""

HESSIAN_STEP = 1e-6
"""rad and m: the Hessian only steers the descent."""


@dataclass(frozen=True, eq=False)
class RestState:
    """A state of rest.

    motion is at zero velocity; own are the elements' own states; energy, J, is what the elements
    store there; gradient, N m and N, is the largest generalized force that is left.
    """

    motion: Motion
    own: Array
    energy: float
    gradient: float

    @property
    def found(self) -> bool:
        """Whether this is a rest state, and one inside the range of eq. 5."""
        return self.gradient <= GRADIENT_TOLERANCE and bool(regularity(self.motion.Theta) > 0)


def nearest_rest_state(system: System) -> RestState:
    """The rest state reached by going downhill in potential energy from the unloaded position.

    A rest state is a zero of the gradient of the stored energy over all configurations that the
    connection allows; downhill from Θ = 0, X = X_a, own states 0 it is a minimum. Where there are
    several rest states this is one of them: whether it is the only one is another question.

    Returns:
        The state where the descent ended; `RestState.found` says whether it arrived.
    """
    still = configurations(system)
    energy, q = still.energy, still.unloaded
    if _steepness(energy, q) > GRADIENT_TOLERANCE:
        # Numbers near the end of their range make the descent fail: `found` says so.
        with suppress(ArithmeticError, ValueError, np.linalg.LinAlgError):
            q = _descend(energy, q)
    return rest_state_at(still, q)


def rest_state_at(still: Configurations, q: Array) -> RestState:
    """A configuration as a state of rest, with the force that is left in it."""
    steepness = _steepness(still.energy, q)
    return RestState(still.motion(q), q[still.placing :], float(still.energy(q)), steepness)


def _steepness(energy: Callable[[Array], Any], q: Array) -> float:
    return float(np.abs(jacobian(energy, q)).max())


def _descend(energy: Callable[[Array], Any], q: Array) -> Array:
    # Imported late: without a load the descent has nothing to do.
    from scipy.optimize import minimize

    def gradient(q: Array) -> Array:
        return jacobian(energy, q)

    def hessian(q: Array) -> Array:
        shifts = HESSIAN_STEP * np.eye(len(q))
        rows = [
            (gradient(q + shift) - gradient(q - shift)) / (2 * HESSIAN_STEP) for shift in shifts
        ]
        return 0.5 * (np.array(rows) + np.array(rows).T)

    options = {"gtol": GRADIENT_TOLERANCE, "maxiter": MAX_STEPS}
    found = minimize(energy, q, jac=gradient, hess=hessian, method="trust-exact", options=options)
    # One Newton step more costs nothing, and takes the position to round-off as well.
    polished = found.x - np.linalg.solve(hessian(found.x), gradient(found.x))
    return min(found.x, polished, key=lambda q: _steepness(energy, q))
