"""Peer: `scipy.integrate.solve_ivp` with equations in numpy, member after member."""

import sys
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

if __name__ == "__main__":
    from serve import pin_to_core

    pin_to_core()

import numpy as np
from equations import make_rates
from scipy.integrate import solve_ivp


def motions(
    rates: Callable[..., Any],
    problem: Mapping[str, Any],
    method: str,
    tolerance: float,
    members: int,
) -> Any:
    """Return the states of the first members at all samples, shape (members, samples, 12).

    Args:
        rates: The right-hand side.
        problem: `starts`, the initial states; `times`, the samples in s.
        method: The integrator.
        tolerance: The relative and the absolute tolerance of a step.
        members: How many.
    """
    times = np.array(problem["times"])
    solutions = []
    for start in problem["starts"][:members]:
        solution = solve_ivp(
            rates,
            (times[0], times[-1]),
            np.array(start),
            method=method,
            t_eval=times,
            rtol=tolerance,
            atol=tolerance,
        )
        solutions.append(solution.y.T)
    return np.array(solutions)


def peer(method: str, problem: Mapping[str, Any]) -> Callable[[float, int], Callable[[bool], Any]]:
    """Return the function that prepares the integration of the members."""
    rates = make_rates(np, problem)
    return lambda tolerance, members: lambda _: motions(rates, problem, method, tolerance, members)


if __name__ == "__main__":
    from serve import serve

    serve(partial(peer, sys.argv[1]), ("numpy", "scipy"))
