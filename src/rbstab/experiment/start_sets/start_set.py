"""The set of the starts of a config whose initial state has tolerances."""

from collections.abc import Sequence

import numpy as np

from rbstab.config.build import start_of
from rbstab.config.numbers import replaced
from rbstab.config.schema import Config
from rbstab.config.tolerances import Tolerance
from rbstab.experiment.convergence.enclosed_system import enclosed_system
from rbstab.mechanics.numbers import Array
from rbstab.proof.motion.graph import Graph, proof_precision
from rbstab.proof.motion.linear_flow import frames_of
from rbstab.proof.motion.models import Models, evaluated
from rbstab.proof.motion.monomials import Monomials, monomials_up_to
from rbstab.proof.motion.motion_set import MotionSet
from rbstab.proof.motion.program import program
from rbstab.proof.motion.rounding import rounded_up

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
    """Return the set of all starts, as the only one.

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
    graph, count = Graph(), len(tolerances)
    z = graph.variables(count)
    with proof_precision():
        numbers = {
            path: one.middle + variable * one.radius
            for one, variable in zip(tolerances, z, strict=True)
            for path in one.entry.paths
        }
        system = enclosed_system(config, graph.numbers)
        start = start_of(replaced(config, numbers), system, graph.numbers)
        forms = graph.traced(lambda _: start, z)
        of_z = program(graph, count, forms)
    space = monomials_of(count)
    found = evaluated(of_z, _variables(space))
    frame = np.diag(scale)[np.newaxis]
    with np.errstate(all="ignore"):
        radius = rounded_up(found.remainder.T / scale)
        states = MotionSet(space, found.polynomial[0].swapaxes(0, 1), frame, radius)
        usable = np.isfinite(frames_of(frame).error).all() and np.isfinite(states.error).all()
    return states if usable else None


def _variables(space: Monomials) -> Models:
    """Return the models of z."""
    polynomial = np.zeros((1, space.variables, 1, len(space)))
    polynomial[0, :, 0, 1 : space.variables + 1] = np.eye(space.variables)
    return Models(space, polynomial, np.zeros((space.variables, 1)))
