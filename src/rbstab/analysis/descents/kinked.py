"""Descent in an energy with kinks, to a minimum that may lie on some of them.

The force of an element with kinks (`Element.kinked`) jumps where one of its event functions g is
zero. The stored energy U(q; m) is linear in each of its modes m. On a kink a body rests where a
mode between 0 and 1 balances the forces:

    ∂U/∂q (q; m) = 0, and g = 0 or m is the mode of the side of q (0 <= m <= 1).

First the modes are replaced by smooth functions of g, which become ever steeper. So the descent
comes close to the minimum, and the modes show which kinks it lies on. Newton steps then solve the
equations above.
"""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from rbstab.analysis.configuration import Configurations
from rbstab.analysis.descents.descent import HESSIAN_STEP, descend_from
from rbstab.integrate.straight_line.equations import StraightLine
from rbstab.mechanics.derivatives import jacobian
from rbstab.mechanics.numbers import Array, Number, sqrt
from rbstab.systems.modes import guards_at, modes_of, with_modes, with_modes_at
from rbstab.systems.system import System

WIDTHS = tuple(10.0**exponent for exponent in range(-2, -8, -1))
"""m and rad: the widths over which the modes change, one after the other."""

BETWEEN = 1e-3
"""A mode farther than this from 0 and 1, at the last width, is that of a kink under the minimum."""

SOLVED = 1e-15
"""The relative change of q and the modes at which the equations are solved: round-off."""

ON_KINK = 1e-9
"""m and rad: the largest |g| of a body that rests on a kink."""


class KinkedMinimum(NamedTuple):
    """The end of a descent.

    Attributes:
        q: The configuration, shape (n,).
        gradient: The largest generalized force that no mode balances, N m and N; infinite if q is
            not on its kinks.
        on_kink: Whether it lies on a kink.
    """

    q: Array
    gradient: float
    on_kink: bool


def has_kinks(system: System) -> bool:
    """Return whether the stored energy of a system has kinks."""
    return any(type(element).kinked for element in system.elements)


def descend_to_kinks(
    at_rest: Configurations,
    q: Array,
    tolerance: float,
    is_late: Callable[[], bool],
    is_inside: Callable[[Array], Array],
) -> KinkedMinimum:
    """Descend in energy from a configuration to a minimum, on kinks or beside them.

    Args:
        at_rest: The configurations.
        q: The first configuration, shape (n,).
        tolerance: The largest generalized force at the end, N m and N.
        is_late: Returns whether the descent must end now.
        is_inside: As for `descend`.
    """
    energy = _ModedEnergy(at_rest)
    for width in WIDTHS:
        step = HESSIAN_STEP * min(1.0, 10.0 * width)
        q, _ = descend_from(partial(energy.smoothed, width), q, tolerance, is_late, is_inside, step)
    modes = energy.smooth_modes(q, WIDTHS[-1])
    held = (modes > BETWEEN) & (modes < 1.0 - BETWEEN)
    while True:
        minimum, modes = _solved(energy, q, modes, held)
        outside = held & ~((modes >= 0.0) & (modes <= 1.0))
        if not outside.any():
            return minimum
        held &= ~outside


class _ModedEnergy:
    """The energy of configurations as a function of the modes of the kinked elements."""

    def __init__(self, at_rest: Configurations) -> None:
        self._at_rest, self._system = at_rest, at_rest.system
        count, size = len(_kinked_modes(at_rest.system)), at_rest.size
        self._energy = StraightLine(_energy_of, self._system, size + count)
        self._guards = StraightLine(_guards_of, self._system, size)
        self._switches = len(modes_of(self._system)) > count

    def at(self, q: Array) -> Callable[[Array, Array], Number]:
        """Return the energy as a function of q and the kinked modes, near a configuration."""
        at_rest, energy = self._at_rest, self._energy
        # The other modes are those of this configuration.
        if self._switches:
            energy = energy.in_modes_of(with_modes_at(self._system, at_rest.state(q)))
        return lambda x, modes: (
            energy(np.concatenate([at_rest.placed(x), modes]))[0] + at_rest.spring(x)
        )

    def slope(self, q: Array, modes: Array) -> Array:
        """Return ∂U/∂q at q in these modes, shape (n,): N m and N."""
        at = self.at(q)
        return jacobian(lambda x: at(x, modes), q)

    def guards(self, q: Array) -> Array:
        """Return the event functions of the kinked elements at q, of floats or complex numbers."""
        return self._guards(self._at_rest.placed(q))

    def smooth_modes(self, q: Array, width: float) -> Array:
        """Return ½(1 + g/√(g² + δ²)) of the kinked modes, with the width δ."""
        g = self.guards(q)
        return 0.5 * (1.0 + g / sqrt(g * g + width * width))

    def smoothed(self, width: float, q: Array) -> Callable[[Array], Number]:
        """Return the energy with smooth modes as a function near q."""
        at = self.at(q)
        return lambda x: at(x, self.smooth_modes(x, width))


def _solved(
    energy: _ModedEnergy, q: Array, modes: Array, held: Array
) -> tuple[KinkedMinimum, Array]:
    """Solve ∂U/∂q = 0 and g = 0 on the held kinks, and return the modes there."""
    from scipy.optimize import root  # imported late, as in `searched`

    modes, size = np.where(held, modes, np.round(modes)), len(q)

    def split(unknowns: Array) -> tuple[Array, Array]:
        there = modes.copy()
        there[held] = unknowns[size:]
        return unknowns[:size], there

    def equations(unknowns: Array) -> Array:
        x, there = split(unknowns)
        return np.concatenate([energy.slope(x, there), energy.guards(x)[held]])

    unknowns = np.concatenate([q, modes[held]])
    # Kinks at which the forces are not determined have many solutions: any of them will do.
    unknowns = root(equations, unknowns, method="lm", tol=SOLVED).x
    q, modes = split(unknowns)
    left, g = np.abs(equations(unknowns)), energy.guards(q)
    sides = np.all((g[~held] > 0) == (modes[~held] > 0.5))
    on_kinks = left[size:].max(initial=0.0) <= ON_KINK
    gradient = float(left[:size].max()) if on_kinks and sides else np.inf
    return KinkedMinimum(q, gradient, bool(held.any())), modes


def _energy_of(system: System, variables: Array) -> Array:
    """Return the energy at [q, modes of the kinked elements], shape (1,)."""
    at_rest, modes, places = Configurations(system), _modes(system), _kinked_modes(system)
    y = at_rest.state(variables[: at_rest.size])
    for place, mode in zip(places, variables[at_rest.size :], strict=True):
        modes[place] = mode
    return np.array([with_modes(system, tuple(modes)).potential_energy(y)])


def _guards_of(system: System, q: Array) -> Array:
    """Return the event functions of the kinked elements at q."""
    return guards_at(system, Configurations(system).state(q))[_kinked_modes(system)]


def _kinked_modes(system: System) -> list[int]:
    """Return the places of the modes of kinked elements among all modes."""
    counts = [element.mode_count for element in system.elements]
    kinked = np.repeat([type(element).kinked for element in system.elements], counts)
    return [int(place) for place in np.flatnonzero(kinked)]


def _modes(system: System) -> list[Any]:
    """Return the modes of a system, of any kind of number."""
    elements: list[Any] = [element for element in system.elements if element.mode_count]
    return [mode for element in elements for mode in element.mode]
