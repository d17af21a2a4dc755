"""The smooth system whose rest states are those of a problem."""

from dataclasses import replace

from rbstab.integrate.problem import Problem
from rbstab.systems.connector import connector_of, inside_layers
from rbstab.systems.coordinates import ReducedCoordinates
from rbstab.systems.system import System


def smooth_rest_system(problem: Problem) -> System:
    """Return a smooth system with the same rest state as a problem.

    At rest a sliding connector holds the contact point, if its force is large enough. In a boundary
    layer of s = E it acts as a spring.
    """
    if problem.switching is None:
        return problem.system
    if problem.switching.layered and connector_of(problem.system).rate_weight == 0.0:
        return inside_layers(problem.system)
    return replace(problem.system, coordinates=ReducedCoordinates())
