"""The rest state at which the Lyapunov function is zero."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np

from rbstab.analysis.configuration import Configurations, configurations
from rbstab.mechanics.attitude import in_range, is_upright
from rbstab.mechanics.derivatives import jacobian
from rbstab.mechanics.motion import Motion
from rbstab.mechanics.numbers import Array
from rbstab.systems.system import System

GRADIENT_TOLERANCE = 1e-7
"""N m and N. The energy error is the squared gradient divided by a stiffness.

So this tolerance leaves the energy exact to round-off for every stiffness above 1e-6.
`gradient_tolerance` scales it for loads below 1 N and above 1e5 N.
"""

FORCE_ERROR = 1e-12
"""The round-off of a generalized force, relative to the forces that balance in it."""

MAX_STEPS = 100
"""The maximum number of steps of the descent; about ten are enough if a rest state exists."""

HESSIAN_STEP = 1e-6
"""rad and m. The Hessian only guides the descent, so it need not be accurate. The step grows with
coordinates above 1000, because it would be lost in their round-off."""

MAX_POLISHES = 5
"""The maximum number of Newton steps after the descent. One is enough unless loads are extreme."""


@dataclass(frozen=True, eq=False)
class RestState:
    """The system without velocity in one configuration; a rest state if `found`.

    motion has zero velocity. own are the elements' own states. energy, J, is the energy stored in
    the elements. gradient, N m and N, is the largest remaining generalized force. load, N m and N,
    is the largest of the forces that balance.
    """

    motion: Motion
    own: Array
    energy: float
    gradient: float
    load: float = 1.0

    @property
    def is_at_rest(self) -> bool:
        """Whether this is a rest state with |θ2| < π/2; θ1 and θ3 may be any angles."""
        tolerance = max(GRADIENT_TOLERANCE, FORCE_ERROR * self.load)
        return self.gradient <= tolerance and bool(is_upright(self.motion.Theta))

    @property
    def found(self) -> bool:
        """Whether this is a rest state inside the range of eq. 5."""
        return self.is_at_rest and bool(in_range(self.motion.Theta))

    @property
    def is_accurate(self) -> bool:
        """Whether the energy is that of a rest state to round-off, also for very small loads."""
        return self.is_at_rest and self.gradient <= gradient_tolerance(self.load)


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
    tolerance = gradient_tolerance(largest_load(at_rest, q))
    if _steepness(energy, q) > tolerance:
        # Numbers near overflow make the descent fail; then `found` is false.
        with suppress(ArithmeticError, ValueError, np.linalg.LinAlgError):
            q = _descend(energy, q, tolerance)
    return rest_state_at(at_rest, q)


def rest_state_at(at_rest: Configurations, q: Array) -> RestState:
    """Return the `RestState` of a configuration q, with its remaining generalized force."""
    steepness, load = _steepness(at_rest.energy, q), largest_load(at_rest, q)
    motion, own = at_rest.motion(q), q[at_rest.pose_size :]
    return RestState(motion, own, float(at_rest.energy(q)), steepness, load)


def gradient_tolerance(load: float) -> float:
    """Return the gradient, N m and N, at which a descent ends.

    Args:
        load: The largest of the forces that balance at rest, N m and N.
    """
    return max(GRADIENT_TOLERANCE * min(load, 1.0), FORCE_ERROR * load)


def largest_load(at_rest: Configurations, q: Array) -> float:
    """Return the largest generalized force of a single element, N m and N."""
    return float(np.abs(jacobian(at_rest.energies, q)).max(initial=0.0))


def numerical_hessian(gradient: Callable[[Array], Array], q: Array) -> Array:
    """Return the Hessian of an energy by differences of its gradient; it guides a descent."""
    steps = HESSIAN_STEP * np.maximum(1.0, 1e-3 * np.abs(q))
    rows = [
        (gradient(q + shift) - gradient(q - shift)) / (2 * step)
        for shift, step in zip(np.diag(steps), steps, strict=True)
    ]
    return 0.5 * (np.array(rows) + np.array(rows).T)


def _steepness(energy: Callable[[Array], Any], q: Array) -> float:
    return float(np.abs(jacobian(energy, q)).max())


def _descend(energy: Callable[[Array], Any], q: Array, tolerance: float) -> Array:
    # Imported late: without a load no descent is needed.
    from scipy.optimize import minimize

    # In these units the gradient has to fall to `GRADIENT_TOLERANCE`.
    unit = tolerance / GRADIENT_TOLERANCE

    def scaled(q: Array) -> Any:
        return energy(q) / unit

    def gradient(q: Array) -> Array:
        return jacobian(scaled, q)

    def hessian(q: Array) -> Array:
        return numerical_hessian(gradient, q)

    options = {"gtol": GRADIENT_TOLERANCE, "maxiter": MAX_STEPS}
    found = minimize(scaled, q, jac=gradient, hess=hessian, method="trust-exact", options=options)
    best = found.x
    for _ in range(MAX_POLISHES):
        # One more Newton step is cheap, and makes the position exact to round-off too.
        polished = best - np.linalg.solve(hessian(best), gradient(best))
        best = min(best, polished, key=lambda q: _steepness(scaled, q))
        if _steepness(scaled, best) <= GRADIENT_TOLERANCE or best is not polished:
            break
    return best
