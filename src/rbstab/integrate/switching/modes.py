"""The modes of a sliding connector, and the smooth system for given modes."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from rbstab.elements.sliding import SlidingConnector
from rbstab.elements.sliding_ties import AtContact
from rbstab.integrate.problem import Switching
from rbstab.mechanics.constraint import mobility
from rbstab.mechanics.motion import contact_directions
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import E_OF_W, F_OF_W
from rbstab.systems.coordinates import ContactCoordinates, PartlyHeldCoordinates
from rbstab.systems.filippov import sides
from rbstab.systems.system import System

UNREACHABLE = 1e300
"""A threshold that s never reaches: it disables an event."""

ROUND_OFF = 1e-9
"""Relative tolerance of the bound of an equivalent force."""


class Modes(NamedTuple):
    """The mode of each axis, as three tuples of three numbers.

    mode is the side of the surface, -1 or 1. It is 0 for an axis that is held on the surface
    (held = 1) or inside the boundary layer (layer = 1).
    """

    mode: tuple[float, float, float]
    layer: tuple[float, float, float] = (0.0, 0.0, 0.0)
    held: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def with_axis(
        self, axis: int, mode: float, *, layer: float = 0.0, held: float = 0.0
    ) -> "Modes":
        """Return these modes with one axis changed."""
        values = zip(self, (mode, layer, held), strict=True)
        return Modes(*(_with_entry(entry, axis, value) for entry, value in values))

    @property
    def any_held(self) -> bool:
        """Whether an axis is held on the surface."""
        return any(self.held)


def _with_entry(
    entry: tuple[float, float, float], axis: int, value: float
) -> tuple[float, float, float]:
    changed = list(entry)
    changed[axis] = value
    return (changed[0], changed[1], changed[2])


def connector_of(system: System) -> SlidingConnector:
    """Return the sliding connector of a system, as eq. 39 with the sides of its modes."""
    for element in system.elements:
        if isinstance(element, SlidingConnector):
            return element
        if isinstance(element, AtContact):
            return element.connector
    raise ValueError("the system has no sliding connector")


def system_for_modes(system: System, modes: Modes) -> System:
    """Return the smooth system for these modes, in coordinates W."""
    connector = connector_of(system)
    changed = replace(connector, mode=np.array(modes.mode), layer=np.array(modes.layer))
    elements = tuple(changed if e is connector else e for e in system.elements)
    coordinates = ContactCoordinates()
    if modes.any_held:
        held = np.array(modes.held)
        coordinates = PartlyHeldCoordinates(held, connector.rate_weight * connector.slope)
    return replace(system, elements=elements, coordinates=coordinates)


@dataclass(frozen=True, eq=False)
class SurfaceDynamics:
    """The quantities that decide the modes at a state, each computed when it is first used.

    Args:
        system: The smooth system of these modes.
        y: The state.
    """

    system: System
    y: Array

    @cached_property
    def surface_rate(self) -> Array:
        """The rate ṡ, shape (3,)."""
        rates = self.system.rates(self.y)
        # In coordinates W the rates of E and F are entries 6 to 12.
        return connector_of(self.system).surface(rates[E_OF_W], rates[F_OF_W])

    @cached_property
    def force(self) -> Array:
        """The contact force Λ, shape (3,), N."""
        return self.system.observe(self.y).contact_force

    @cached_property
    def mobility(self) -> Array:
        """The mobility c'𝒥⁻¹c, shape (3, 3), 1/kg."""
        body = self.system.body
        return mobility(body, contact_directions(body, self.system.motion(self.y)))


def initial_modes(system: System, y: Array, switching: Switching) -> Modes:
    """Return the initial modes, with no axis held."""
    connector, motion = connector_of(system), system.motion(y)
    s = connector.surface(motion.E, motion.F)
    modes = Modes((0.0, 0.0, 0.0))
    for axis in range(3):
        inside = switching.layered and abs(s[axis]) <= connector.layer_width
        # An axis exactly on the surface has the side that it enters next.
        entered_side = s[axis] if s[axis] != 0 else motion.F[axis]
        side = 1.0 if entered_side >= 0 else -1.0
        modes = modes.with_axis(axis, 0.0 if inside else side, layer=float(inside))
    return modes


def thresholds(system: System, modes: Modes, switching: Switching) -> tuple[Array, Array]:
    """Return the values of s that end the modes: upper and lower, each of shape (3,)."""
    width = float(connector_of(system).layer_width) if switching.layered else 0.0
    upper, lower = np.full(3, UNREACHABLE), np.full(3, -UNREACHABLE)
    for axis in range(3):
        if modes.held[axis]:
            continue
        if modes.layer[axis]:
            upper[axis], lower[axis] = width, -width
        elif modes.mode[axis] > 0:
            lower[axis] = width
        else:
            upper[axis] = -width
    return upper, lower


def modes_on_surface(system: System, y: Array, modes: Modes, axes: list[int]) -> Modes:
    """Return Filippov's choice of modes for axes on a surface s = F + κE.

    An axis is held if the equivalent force that keeps ṡ = 0 is inside its bounds ±K_s. Otherwise
    the axis leaves to the side of the sign of ṡ (`systems.filippov`).

    Args:
        system: The system, in any modes.
        y: The state.
        modes: The modes of the other axes.
        axes: The axes on the surface.
    """
    for axis in axes:
        modes = modes.with_axis(axis, 0.0)
    dynamics = SurfaceDynamics(system_for_modes(system, modes), y)
    W, bounds = dynamics.mobility[np.ix_(axes, axes)], connector_of(system).K_s[axes]
    # An axis that needs its whole force, to round-off, is held.
    chosen = sides(W, dynamics.surface_rate[axes], bounds, tolerance=ROUND_OFF)
    for axis, side in zip(axes, chosen.tolist(), strict=True):
        modes = modes.with_axis(axis, side, held=float(side == 0.0))
    return modes
