"""The equations of a system in the forms that proofs of motions need, in each of its modes."""

from collections.abc import Callable, Sequence
from functools import cache, cached_property
from itertools import product
from typing import NamedTuple

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.exact.atoms import Atom
from rbstab.proof.exact.expr import Expr, expr, factored, numbers, variables
from rbstab.proof.exact.rewriting import derivative
from rbstab.proof.motion.models import Models, evaluated
from rbstab.proof.motion.motion_set import MotionSet
from rbstab.proof.motion.program import Program, programs
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
        step: f, and the entries of ∂f/∂y that are not zero; its first nodes are those of `rates`.
        places: The rows and columns of the entries, shape (2, entries).
    """

    rates: Program
    step: Program
    places: Array


class Equations:
    """The equations of a system.

    Args:
        exact_system: Builds the system in a kind of number, from the numbers of its config.

    Attributes:
        switches: The name of the element of each mode.
        size: The number of states, n.
    """

    def __init__(self, exact_system: ExactSystem) -> None:
        with factored():
            self._system = exact_system(numbers)
        self.switches, self.size = mode_owners(self._system), self._system.size
        self._variables = variables(range(self.size))
        self._atom_rates: list[dict[Atom, Expr]] = [{} for _ in range(self.size)]
        for name in ("field", "difference", "_rates", "_energy"):
            setattr(self, name, cache(getattr(self, name)))

    def field(self, modes: Modes = ()) -> Field:
        """Return the equations in some modes."""
        rates = self._rates(modes)
        slopes = {
            (i, j): slope
            for i, rate in enumerate(rates)
            for j, slope in enumerate(self._slopes(rate))
            if slope.terms
        }
        places = np.array(list(slopes), dtype=int).reshape(-1, 2).T
        of_rates, step = programs(self.size, rates, slopes.values())
        return Field(of_rates, step, places)

    def difference(self, modes: Modes, other: Modes) -> Program:
        """Return f in some modes less f in others; what they have in common cancels exactly."""
        pairs = zip(self._rates(modes), self._rates(other), strict=True)
        return self._program([a - b for a, b in pairs])

    def crossing(self, before: Modes, after: Modes, which: int) -> Program:
        """Return f before less f after, g' in both modes, g, and the slopes of g.

        Args:
            before: Some modes.
            after: Others.
            which: The number of g, an event function.
        """
        g = self._guards[which]
        both = self._rates(before), self._rates(after)
        jump = [a - b for a, b in zip(*both, strict=True)]
        with factored():
            rates = [derivative(g, dict(enumerate(some))) for some in both]
        return self._program([*jump, *rates, g, *self._slopes(g)])

    @cached_property
    def guards(self) -> Program:
        """The event functions g."""
        return self._program(self._guards)

    @cached_property
    def _guards(self) -> list[Expr]:
        with factored():
            return [expr(g) for g in guards_at(self._system, self._variables)]

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
        ranges = [evaluated(self._energy(modes), states.models).range() for modes in combinations]
        lows, highs = (np.array([ends[side][0] for ends in ranges]) for side in (0, 1))
        return lows.min(axis=0), highs.max(axis=0)

    def _energy(self, modes: Modes) -> Program:
        with factored():
            energies = with_modes(self._system, modes).observe(self._variables).energy
            return self._program([sum(map(expr, energies.tolist()), expr(0))])

    def _rates(self, modes: Modes) -> list[Expr]:
        with factored():
            return [expr(f) for f in with_modes(self._system, modes).rates(self._variables)]

    def _slopes(self, e: Expr) -> list[Expr]:
        with factored():
            return [
                derivative(e, {j: expr(1)}, atom_rates)
                for j, atom_rates in enumerate(self._atom_rates)
            ]

    def _program(self, results: Sequence[Expr]) -> Program:
        return programs(self.size, results)[0]
