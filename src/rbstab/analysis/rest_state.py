"""The rest state at which the Lyapunov function is zero."""

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
"""N m and N. The energy error is the squared gradient divided by a stiffness.

So this tolerance leaves the energy exact to round-off for every stiffness above 1e-6.
"""

MAX_STEPS = 100
"""The maximum number of steps of the descent; about ten are enough if a rest state exists."""

HESSIAN_STEP = 1e-6
"""rad and m. The Hessian only guides the descent, so it need not be accurate."""


@dataclass(frozen=True, eq=False)
class RestState:
    """The system without velocity in one configuration; a rest state if `found`.

    motion has zero velocity. own are the elements' own states. energy, J, is the energy stored in
    the elements. gradient, N m and N, is the largest remaining generalized force.
    """

    motion: Motion
    own: Array
    energy: float
    gradient: float

    @property
    def found(self) -> bool:
        """Whether this is a rest state inside the range of eq. 5."""
        return self.gradient <= GRADIENT_TOLERANCE and bool(regularity(self.motion.Theta) > 0)


def nearest_rest_state(system: System) -> RestState:
    """Find a rest state by descent in potential energy from the unloaded position.

    A rest state is a zero of the gradient of the stored energy, over all configurations that the
    connector allows. The descent starts at Θ = 0, X = X_a, own states 0, and ends in a minimum. A
    system can have several rest states; this function does not check that.

    Returns:
        The state where the descent ended; check `RestState.found`.
    """
    at_rest = configurations(system)
    energy, q = at_rest.energy, at_rest.unloaded
    if _steepness(energy, q) > GRADIENT_TOLERANCE:
        # Numbers near overflow make the descent fail; then `found` is false.
        with suppress(ArithmeticError, ValueError, np.linalg.LinAlgError):
            q = _descend(energy, q)
    return rest_state_at(at_rest, q)


def rest_state_at(at_rest: Configurations, q: Array) -> RestState:
    """Return the `RestState` of a configuration q, with its remaining generalized force."""
    steepness = _steepness(at_rest.energy, q)
    return RestState(at_rest.motion(q), q[at_rest.pose_size :], float(at_rest.energy(q)), steepness)


def _steepness(energy: Callable[[Array], Any], q: Array) -> float:
    return float(np.abs(jacobian(energy, q)).max())


def _descend(energy: Callable[[Array], Any], q: Array) -> Array:
    # Imported late: without a load no descent is needed.
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
    # One more Newton step is cheap, and makes the position exact to round-off too.
    polished = found.x - np.linalg.solve(hessian(found.x), gradient(found.x))
    return min(found.x, polished, key=lambda q: _steepness(energy, q))
