"""The modes of a sliding connector, and the system that each combination of them makes."""

from dataclasses import replace
from itertools import product
from typing import NamedTuple

import numpy as np

from rbstab.elements.sliding import SlidingConnector
from rbstab.integrate.problem import Switching
from rbstab.mechanics.constraint import mobility
from rbstab.mechanics.motion import contact_directions
from rbstab.mechanics.numbers import Array
from rbstab.systems.coordinates import ContactCoordinates, PartlyHeldCoordinates
from rbstab.systems.system import System

FAR = 1e300
"""A threshold that no surface reaches: it switches an event off."""

ROUND_OFF = 1e-9
"""By how much an equivalent force may exceed its bound, relative to it, when it is released."""


class Modes(NamedTuple):
    """What each axis does, by three tuples of three numbers.

    mode is the side of the surface, -1 or 1, and 0 for an axis that is held on it (held 1) or
    inside the boundary layer (layer 1).
    """

    mode: tuple[float, float, float]
    layer: tuple[float, float, float] = (0.0, 0.0, 0.0)
    held: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def with_axis(
        self, axis: int, mode: float, *, layer: float = 0.0, held: float = 0.0
    ) -> "Modes":
        """The same modes but for one axis."""
        values = zip(self, (mode, layer, held), strict=True)
        return Modes(*(_with(entry, axis, value) for entry, value in values))

    @property
    def any_held(self) -> bool:
        """Whether an axis is held on the surface."""
        return any(self.held)


def _with(entry: tuple[float, float, float], axis: int, value: float) -> tuple[float, float, float]:
    changed = list(entry)
    changed[axis] = value
    return (changed[0], changed[1], changed[2])


def connector_of(system: System) -> SlidingConnector:
    """The sliding connector among the elements of a system."""
    return next(e for e in system.elements if isinstance(e, SlidingConnector))


def system_under(system: System, modes: Modes) -> System:
    """The smooth system that holds as long as the modes do, in coordinates W."""
    connector = connector_of(system)
    changed = replace(connector, mode=np.array(modes.mode), layer=np.array(modes.layer))
    elements = tuple(changed if e is connector else e for e in system.elements)
    coordinates = ContactCoordinates()
    if modes.any_held:
        held = np.array(modes.held)
        coordinates = PartlyHeldCoordinates(held, float(connector.rate_weight * connector.slope))
    return replace(system, elements=elements, coordinates=coordinates)


class Instant(NamedTuple):
    """What decides about modes at one state: ṡ, Λ and W, of shapes (3,) and (3, 3)."""

    surface_rate: Array
    force: Array
    mobility: Array


def instant(system: System, y: Array) -> Instant:
    """ṡ, the contact force and the mobility at a state of a system under its modes."""
    connector, motion = connector_of(system), system.motion(y)
    rates = system.rates(y)
    # In W the rates of E and F are entries 6 to 12.
    surface_rate = connector.surface(rates[6:9], rates[9:12])
    c = contact_directions(system.body, motion)
    force = system.observe(y).contact_force
    return Instant(surface_rate, force, mobility(system.body, c))


def initial_modes(system: System, y: Array, switching: Switching) -> Modes:
    """The modes at a start that is not yet known to slide anywhere."""
    connector, motion = connector_of(system), system.motion(y)
    s = connector.surface(motion.E, motion.F)
    modes = Modes((0.0, 0.0, 0.0))
    for axis in range(3):
        inside = switching.layered and abs(s[axis]) <= connector.layer_width
        # On the surface itself the side is the one that the axis is about to enter.
        entered = s[axis] if s[axis] != 0 else motion.F[axis]
        side = 1.0 if entered >= 0 else -1.0
        modes = modes.with_axis(axis, 0.0 if inside else side, layer=float(inside))
    return modes


def thresholds(system: System, modes: Modes, switching: Switching) -> tuple[Array, Array]:
    """Where s of each axis ends its mode: going up and going down, each of shape (3,)."""
    width = float(connector_of(system).layer_width) if switching.layered else 0.0
    up, down = np.full(3, FAR), np.full(3, -FAR)
    for axis in range(3):
        if modes.held[axis]:
            continue
        if modes.layer[axis]:
            up[axis], down[axis] = width, -width
        elif modes.mode[axis] > 0:
            down[axis] = width
        else:
            up[axis] = -width
    return up, down


def modes_on_surface(system: System, y: Array, modes: Modes, axes: list[int]) -> Modes:
    """Filippov's choice for axes that are on a surface s = F + κE at this instant.

    Each is held where the equivalent force that keeps ṡ = 0 is inside its box, and leaves to the
    side of its ṡ where it is not. Because W is positive definite exactly one choice is consistent;
    at a tie to round-off the one with most axes held is taken.

    Args:
        system: The system, under any modes.
        y: The state.
        modes: The modes of the other axes.
        axes: The axes that are on the surface.
    """
    K_s = connector_of(system).K_s
    choices = sorted(product((0.0, 1.0, -1.0), repeat=len(axes)), key=lambda c: sum(map(abs, c)))
    best, best_violation = modes, np.inf
    for choice in choices:
        tried = modes
        for axis, side in zip(axes, choice, strict=True):
            tried = tried.with_axis(axis, side, held=float(side == 0.0))
        now = instant(system_under(system, tried), y)
        excess = np.abs(now.force) / K_s - 1.0
        inward = -np.array(tried.mode) * now.surface_rate / (np.diag(now.mobility) * K_s)
        wrong = [excess[axis] if tried.held[axis] else inward[axis] for axis in axes]
        violation = max(*wrong, 0.0)
        if violation < best_violation - ROUND_OFF:
            best, best_violation = tried, violation
    return best
