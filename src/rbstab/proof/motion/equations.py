"""The equations of a system in the forms that proofs of motions need, in each of its modes."""

from collections.abc import Callable, Sequence
from functools import cached_property
from itertools import product
from typing import NamedTuple

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.motion.graph import Form, Graph, proof_precision
from rbstab.proof.motion.models import Models, evaluated
from rbstab.proof.motion.motion_set import MotionSet
from rbstab.proof.motion.program import Program, program
from rbstab.systems.modes import Modes, guards_at, mode_owners, with_modes
from rbstab.systems.system import System

ExactSystem = Callable[[Callable[[Array], Array]], System]
"""A function that builds a system in a kind of number, given the conversion of its doubles."""

Possible = list[tuple[float, ...]]
"""The values that each mode may have somewhere in a set."""


class Field(NamedTuple):
    """The equations ẏ = f(y) of a system in one tuple of modes.

    Attributes:
        rates: f.
        step: f, and the entries of ∂f/∂y that are not zero.
        guess: Where `step` has the nodes of `rates`.
        places: The rows and columns of the entries, shape (2, entries).
    """

    rates: Program
    step: Program
    guess: list[int]
    places: Array


class Equations:
    """The equations of a system.

    Args:
        exact_system: Builds the system in a kind of number, from the numbers of its config.

    Attributes:
        switches: The name of the element of each mode.
    """

    def __init__(self, exact_system: ExactSystem) -> None:
        self._graph = Graph()
        with proof_precision():
            self._system = exact_system(self._graph.numbers)
            self._variables = self._graph.variables(self._system.size)
        self.switches = mode_owners(self._system)
        self._fields: dict[Modes, Field] = {}
        self._rates: dict[Modes, tuple[Form, ...]] = {}
        self._energies: dict[Modes, Program] = {}
        self._differences: dict[tuple[Modes, Modes], Program] = {}

    @property
    def size(self) -> int:
        """The number of states, n."""
        return len(self._variables)

    def field(self, modes: Modes = ()) -> Field:
        """Return the equations in some modes."""
        if modes not in self._fields:
            with proof_precision():
                forms = self._forms(modes)
                slopes = self._slopes(forms)
                rates, step = self._program(forms), self._program([*forms, *slopes.values()])
            places = np.array(list(slopes), dtype=int).reshape(-1, 2).T
            self._fields[modes] = Field(rates, step, rates.places_in(step), places)
        return self._fields[modes]

    def difference(self, modes: Modes, other: Modes) -> Program:
        """Return f in some modes less f in others; what they have in common cancels exactly."""
        if (modes, other) not in self._differences:
            with proof_precision():
                pairs = zip(self._forms(modes), self._forms(other), strict=True)
                self._differences[modes, other] = self._program([a - b for a, b in pairs])
        return self._differences[modes, other]

    def crossing(self, before: Modes, after: Modes, which: int) -> Program:
        """Return f before less f after, g' in both modes, g, and the slopes of g.

        Args:
            before: Some modes.
            after: Others.
            which: The number of g, an event function.
        """
        with proof_precision():
            g = self._guards[which]
            slopes = [self._graph.derivative(g, j) for j in range(self.size)]
            both = (self._forms(before), self._forms(after))
            jump = [a - b for a, b in zip(*both, strict=True)]
            rates = [
                sum((s * f for s, f in zip(slopes, some, strict=True)), g * 0.0) for some in both
            ]
            return self._program([*jump, *rates, g, *slopes])

    @cached_property
    def guards(self) -> Program:
        """The event functions g."""
        with proof_precision():
            return self._program(self._guards)

    @cached_property
    def _guards(self) -> tuple[Form, ...]:
        return self._graph.traced(lambda y: guards_at(self._system, y), self._variables)

    def possible(self, states: Models) -> Possible:
        """Return the modes that states may have somewhere: models of one set."""
        low, high = evaluated(self.guards, states).range()
        return [
            (1.0,) if least > 0 else (0.0,) if most < 0 else (0.0, 1.0)
            for least, most in zip(low[:, 0].tolist(), high[:, 0].tolist(), strict=True)
        ]

    def energy_bounds(self, states: MotionSet) -> tuple[Array, Array]:
        """Return bounds on the sum of all energies, J, in all modes that are possible in a set.

        A system that switches is given one set at a time.

        Returns:
            The least and the largest values, each of shape (sets,); NaN is no bound.
        """
        combinations = product(*self.possible(states.models)) if self.switches else [()]
        found = [evaluated(self._energy(modes), states.models).range() for modes in combinations]
        lows, highs = (np.array([one[side][0] for one in found]) for side in (0, 1))
        return lows.min(axis=0), highs.max(axis=0)

    def _energy(self, modes: Modes) -> Program:
        if modes not in self._energies:
            system = with_modes(self._system, modes)
            with proof_precision():
                forms = self._graph.traced(
                    lambda y: sum(system.observe(y).energy.tolist()), self._variables
                )
                self._energies[modes] = self._program(forms)
        return self._energies[modes]

    def _forms(self, modes: Modes) -> tuple[Form, ...]:
        if modes not in self._rates:
            system = with_modes(self._system, modes)
            self._rates[modes] = self._graph.traced(system.rates, self._variables)
        return self._rates[modes]

    def _slopes(self, forms: Sequence[Form]) -> dict[tuple[int, int], Form]:
        found = {
            (i, j): self._graph.derivative(form, j)
            for i, form in enumerate(forms)
            for j in range(self.size)
        }
        return {place: slope for place, slope in found.items() if not slope.is_zero}

    def _program(self, forms: Sequence[Form]) -> Program:
        return program(self._graph, self.size, forms)
