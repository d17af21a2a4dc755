"""The set of the starts of a config whose initial state has tolerances."""

from collections.abc import Sequence

import numpy as np

from rbstab.analysis.motion_proof.linear_flow import frames_of
from rbstab.analysis.motion_proof.rounding import rounded_up
from rbstab.analysis.motion_proof.sets.graph import Graph, traced
from rbstab.analysis.motion_proof.sets.models import Model, evaluated, program
from rbstab.analysis.motion_proof.sets.monomials import Monomials, monomials_up_to
from rbstab.analysis.motion_proof.sets.motion_set import MotionSet
from rbstab.config.build import start_of
from rbstab.config.entries import replaced
from rbstab.config.schema import Config
from rbstab.config.tolerances import Tolerance
from rbstab.experiment.convergence.enclosed_system import enclosed_system
from rbstab.mechanics.numbers import Array

MAX_DEGREE = 6
"""The highest degree in z."""

MAX_MONOMIALS = 210
"""The most monomials in z: with more numbers that have a tolerance, the degree is lower."""


def monomials_of(variables: int) -> Monomials:
    """Return the monomials in z for a number of tolerances."""
    degree = MAX_DEGREE
    while degree > 1 and len(Monomials(variables, degree)) > MAX_MONOMIALS:
        degree -= 1
    return monomials_up_to(variables, degree)


def start_set_of(config: Config, tolerances: Sequence[Tolerance], scale: Array) -> MotionSet | None:
    """Return the set of all starts, as the only one; call it in `proof_precision`.

    The number with the i-th tolerance is middle + radius z_i, with |z_i| <= 1.

    Args:
        config: The config.
        tolerances: Tolerances of its initial state.
        scale: The size of each state, shape (n,).

    Returns:
        The set; None if the starts have no bounds.

    Raises:
        ValueError: There is no tolerance, or one is not of the initial state.
    """
    if not tolerances or any(one.section != "initial" for one in tolerances):
        raise ValueError("a set of starts needs tolerances of the initial state, and no others")
    graph = Graph()
    z = graph.variables(len(tolerances))
    numbers = {
        path: one.middle + variable * one.radius
        for one, variable in zip(tolerances, z, strict=True)
        for path in one.entry.paths
    }
    system = enclosed_system(config, graph.numbers)
    start = start_of(replaced(config, numbers), system, graph.numbers)
    space = monomials_of(len(tolerances))
    forms = traced(lambda _: start, graph, z)
    found = evaluated(program(graph, forms), [_variable(space, i) for i in range(len(tolerances))])
    remainder = np.array([[one.remainder[0] for one in found]])
    polynomial = np.array([[one.polynomial[:, 0] for one in found]])
    frame = np.diag(scale)[np.newaxis]
    with np.errstate(all="ignore"):
        states = MotionSet(space, polynomial, frame, rounded_up(remainder / scale))
        usable = np.isfinite(frames_of(frame).error).all() and np.isfinite(states.error).all()
    return states if usable else None


def _variable(space: Monomials, index: int) -> Model:
    """Return the model of z_i."""
    polynomial = np.zeros((len(space), 1))
    polynomial[1 + index] = 1.0
    return Model(space, polynomial, np.zeros(1))
