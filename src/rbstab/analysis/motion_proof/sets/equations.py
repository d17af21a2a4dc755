"""The equations of a system in the forms that proofs of sets of motions need."""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np

from rbstab.analysis.motion_proof.sets.graph import Form, Graph, traced
from rbstab.analysis.motion_proof.sets.models import Program, program
from rbstab.mechanics.numbers import Array
from rbstab.systems.system import System

ExactSystem = Callable[[Callable[[Array], Array]], System]
"""A function that builds a system in a kind of number, given the conversion of its doubles."""


class Equations(NamedTuple):
    """The equations ẏ = f(y) of a system.

    Attributes:
        rates: f as a program.
        jacobian: The entries of ∂f/∂y that are not zero, as a program.
        places: Their rows and columns.
        energy: The sum of all energies, as a program.
    """

    rates: Program
    jacobian: Program
    places: tuple[tuple[int, int], ...]
    energy: Program


def equations_of(exact_system: ExactSystem) -> Equations:
    """Return the equations of a system; call it in `proof_precision`.

    Args:
        exact_system: Builds the system in a kind of number, from the numbers of its config.
    """
    graph = Graph()
    system = exact_system(graph.numbers)
    variables = graph.variables(system.size)
    rates = traced(system.rates, graph, variables)
    slopes = {
        (i, j): slope
        for i, form in enumerate(rates)
        for j in range(len(variables))
        if not _is_zero(slope := graph.derivative(form, j))
    }
    energy = traced(partial(_total_energy, system), graph, variables)
    return Equations(
        program(graph, rates),
        program(graph, slopes.values()),
        tuple(slopes),
        program(graph, energy),
    )


def _total_energy(system: System, y: Array) -> Array:
    return np.array([sum(system.observe(y).energy.tolist())], dtype=object)


def _is_zero(form: Form) -> bool:
    return not form.terms and bool(form.constant == 0)
