"""Exact derivatives of the equations by complex steps."""

from collections.abc import Callable
from typing import Any

import numpy as np

from rbstab.mechanics.numbers import Array

STEP = 1e-200
"""h: far below the round-off of any state, but h times a derivative does not underflow."""


def jacobian(function: Callable[[Array], Any], x: Array) -> Array:
    """Compute ∂f/∂x by Im f(x + ih e_k) / h, exact to round-off because nothing is subtracted.

    Args:
        function: f, analytic, as all equations of this project are. It takes a complex array of
            shape (n,) and returns shape (m,), or a scalar.
        x: The point, shape (n,).

    Returns:
        The derivatives, shape (m, n); for a scalar function its gradient, shape (n,).

    Source: W. Squire and G. Trapp, SIAM Review 40 (1998) 110-112.
    """
    shifts = x + 1j * STEP * np.eye(len(x))
    columns = [np.imag(function(shifted)) / STEP for shifted in shifts]
    return np.array(columns).T


def derivative_along(function: Callable[[Array], Any], x: Array, direction: Array) -> Any:
    """Compute (∂f/∂x) d by Im f(x + ih d) / h, with one evaluation of f for any n.

    Args:
        function: f, as for `jacobian`.
        x: The point, shape (n,).
        direction: d, shape (n,).

    Returns:
        The derivative, in the shape of f.
    """
    return np.imag(function(x + 1j * STEP * direction)) / STEP
