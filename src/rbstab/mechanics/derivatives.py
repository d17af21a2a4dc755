"""Exact derivatives of the equations by complex steps."""

from collections.abc import Callable
from typing import Any

import numpy as np

from rbstab.mechanics.numbers import Array

STEP = 1e-200
"""h: far below round-off of any state, far above underflow of what it is multiplied with."""


def jacobian(function: Callable[[Array], Any], x: Array) -> Array:
    """∂f/∂x by Im f(x + ih e_k) / h, exact to round-off because nothing is subtracted.

    Args:
        function: f, which takes an array of shape (n,) of complex numbers and returns shape (m,),
            or a scalar. It must be analytic: all of the project's equations are.
        x: The point, shape (n,).

    Returns:
        The derivatives, shape (m, n); for a scalar function its gradient, shape (n,).

    Source: W. Squire and G. Trapp, SIAM Review 40 (1998) 110-112.
    """
    shifts = x + 1j * STEP * np.eye(len(x))
    columns = [np.imag(function(shifted)) / STEP for shifted in shifts]
    return np.array(columns).T


def derivative_along(function: Callable[[Array], Any], x: Array, direction: Array) -> Any:
    """(∂f/∂x) d by Im f(x + ih d) / h: one evaluation, whatever the number of states.

    Args:
        function: f, as for `jacobian`.
        x: The point, shape (n,).
        direction: d, shape (n,).

    Returns:
        The derivative, of the shape of f.
    """
    return np.imag(function(x + 1j * STEP * direction)) / STEP
