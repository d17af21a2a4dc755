"""Descent in energy to a minimum, by a damped Newton method, for many starts at once."""

from collections.abc import Callable
from functools import partial
from typing import Protocol

import numpy as np

from rbstab.mechanics.derivatives import jacobian
from rbstab.mechanics.numbers import Array, Number

MAX_STEPS = 300
"""The maximum number of steps. About five are enough near a minimum, about a hundred in a curved
valley."""

ANGLES = slice(0, 3)
"""The entries of q that are angles, at most."""

MAX_STEP = 0.5
"""rad and m: longer steps are cut to this, so that the descent does not leave its valley. In other
entries than angles it doubles with each step, as a soft body may rest far away."""

SHORTEST_STEP = 1e-4
"""A step that was shortened by this factor, and still raises the energy, ends the descent."""

MIN_CURVATURE = 1e-8
"""The smallest curvature that the method divides by, relative to the largest."""

HESSIAN_STEP = 1e-6
"""rad and m. The Hessian only guides the descent, so it need not be accurate. The step grows with
coordinates above 1000, because it would be lost in their round-off."""

ROUND_OFF = 1e-12
"""Allowed rise of the energy in a step, relative to the energy plus 1 J."""


class EnergyAt(Protocol):
    """Energies with their derivatives at m points.

    A descent reads the Hessians only if it makes another step.
    """

    @property
    def value(self) -> Array:
        """The energies, shape (m,), J."""

    @property
    def gradient(self) -> Array:
        """Their gradients, shape (m, n)."""

    @property
    def hessian(self) -> Array:
        """Their Hessians, shape (m, n, n)."""


class _SingleEnergy:
    """An energy at one point (an `EnergyAt`); its Hessian is computed when it is read."""

    def __init__(self, value: Callable[[Array], Number], q: Array, step: float) -> None:
        # The energy takes complex numbers; the step is of the differences for the Hessian.
        self._slope, self._q, self._step = partial(jacobian, value), q, step
        self.value = np.array([float(value(q))])
        self.gradient = self._slope(q)[np.newaxis]

    @property
    def hessian(self) -> Array:
        """The Hessian, shape (1, n, n)."""
        return numerical_hessian(self._slope, self._q, self._step)[np.newaxis]


EnergyFunction = Callable[[Array, Array], EnergyAt]
"""Returns the energies of the problems with the numbers `rows`, shape (k,), at q, shape (n, k)."""


@np.errstate(all="ignore")  # comparisons with NaN are false
def descend(
    energy: EnergyFunction,
    starts: Array,
    tolerance: Array,
    is_late: Callable[[], bool] = lambda: False,
    is_inside: Callable[[Array], Array] | None = None,
) -> tuple[Array, Array, Array]:
    """Descend from each start until the gradient is within its tolerance.

    The end is a minimum; or a saddle, if the gradient has no component along its downward
    directions on the way. The Newton step uses the absolute values of the eigenvalues of the
    Hessian, so that it leads downwards everywhere. It is halved as long as the energy rises.

    Args:
        energy: The energies.
        starts: Shape (n, m).
        tolerance: The size of the gradient at which the descent of each problem ends, shape (m,).
        is_late: Returns whether the descents must end now.
        is_inside: Returns whether points, shape (n, k), may be visited, shape (k,); default all. A
            step to another point is shortened, like one that leads upwards.

    Returns:
        The end points, shape (n, m); the energies there, shape (m,), J; and whether the gradient is
        within its tolerance, shape (m,).
    """
    q = starts.copy()
    rows = np.arange(q.shape[1])
    at = energy(rows, q)
    value, gradient = at.value.copy(), at.gradient.copy()
    hessian = np.empty((*gradient.shape, gradient.shape[1]))
    accepted, lower = rows, np.ones(len(rows), dtype=bool)
    shortened, reach = np.ones(len(rows)), np.full(len(rows), MAX_STEP)
    for _ in range(MAX_STEPS):
        steep = np.abs(gradient).max(axis=1) > tolerance
        rows = np.flatnonzero(steep & (shortened > SHORTEST_STEP))
        if not len(rows) or is_late():
            break
        hessian[accepted] = at.hessian[lower]
        steps = _steps(gradient[rows], hessian[rows], reach[rows])
        trial = q[:, rows] + shortened[rows] * steps.T
        at = energy(rows, trial)
        slack = ROUND_OFF * (np.abs(value[rows]) + 1.0)
        lower = at.value <= value[rows] + slack
        if is_inside is not None:
            lower &= is_inside(trial)
        accepted = rows[lower]
        q[:, accepted], value[accepted] = trial[:, lower], at.value[lower]
        gradient[accepted] = at.gradient[lower]
        shortened[accepted] = np.minimum(1.0, 2.0 * shortened[accepted])
        shortened[rows[~lower]] *= 0.5
        reach[accepted] *= 2.0
    return q, value, np.abs(gradient).max(axis=1) <= tolerance


def descend_from(  # noqa: PLR0913, PLR0917 (as `descend`)
    near: Callable[[Array], Callable[[Array], Number]],
    start: Array,
    tolerance: float,
    is_late: Callable[[], bool],
    is_inside: Callable[[Array], Array],
    step: float = HESSIAN_STEP,
) -> tuple[Array, bool]:
    """Descend from one start; return the end, shape (n,), and whether it is without slope.

    Args:
        near: Returns the energy as a function near a point, which takes complex numbers too.
        start: Shape (n,).
        tolerance: As for `descend`, of one problem.
        is_late: As for `descend`.
        is_inside: As for `descend`.
        step: The step of the differences for the Hessian.
    """

    def energy(_rows: Array, q: Array) -> _SingleEnergy:
        return _SingleEnergy(near(q[:, 0]), q[:, 0], step)

    starts, tolerances = start[:, np.newaxis], np.array([tolerance])
    ends, _, (is_flat,) = descend(energy, starts, tolerances, is_late, is_inside)
    return ends[:, 0], bool(is_flat)


def _steps(gradient: Array, hessian: Array, reach: Array) -> Array:
    """Return the Newton steps with the absolute values of the curvatures, shape (m, n)."""
    finite = np.isfinite(hessian).all(axis=(1, 2), keepdims=True)
    curvatures, axes = np.linalg.eigh(np.where(finite, hessian, 0.0))
    sizes = np.abs(curvatures)
    sizes = np.maximum(sizes, MIN_CURVATURE * sizes.max(axis=1, keepdims=True))
    along = np.einsum("mik,mi->mk", axes, gradient) / sizes
    steps = -np.einsum("mik,mk->mi", axes, along)
    longest, turn = np.abs(steps).max(axis=1), np.abs(steps[:, ANGLES]).max(axis=1)
    # They are cut to `MAX_STEP` in angles, and to `reach` in all entries.
    share = np.minimum(1.0, np.minimum(MAX_STEP / turn, reach / longest))
    limited: Array = steps * share[:, np.newaxis]
    return limited


def numerical_hessian(
    gradient: Callable[[Array], Array], q: Array, step: float = HESSIAN_STEP
) -> Array:
    """Return the Hessian of an energy by differences of its gradient; it guides a descent.

    Args:
        gradient: Returns the gradient at q, shape (n,).
        q: Where, shape (n,).
        step: The step of the differences; it is larger for an entry of q above 1000.
    """
    steps = step * np.maximum(1.0, 1e-3 * np.abs(q))
    rows = [
        (gradient(q + shift) - gradient(q - shift)) / (2 * size)
        for shift, size in zip(np.diag(steps), steps, strict=True)
    ]
    return 0.5 * (np.array(rows) + np.array(rows).T)
