"""Peer: `scipy.integrate.solve_ivp` with equations compiled by numba, member after member."""

import sys
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

if __name__ == "__main__":
    from serve import pin_to_core

    pin_to_core()

import numpy as np
from equations import make_rates
from numba import njit
from scipy_numpy import motions


def peer(method: str, problem: Mapping[str, Any]) -> Callable[[float, int], Callable[[bool], Any]]:
    """Compile the equations; return the function that prepares the integration of the members."""
    rates = make_rates(np, problem, njit)
    rates(0.0, np.array(problem["starts"][0]))
    return lambda tolerance, members: lambda _: motions(rates, problem, method, tolerance, members)


if __name__ == "__main__":
    from serve import serve

    serve(partial(peer, sys.argv[1]), ("numba", "numpy", "scipy"))
