"""Random systems of a body and one element, and random states."""

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from rbstab.elements.declarations import Gain
from rbstab.elements.element import Element
from rbstab.mechanics.algebra import ZERO
from rbstab.mechanics.body import Body
from rbstab.mechanics.derivatives import jacobian
from rbstab.mechanics.motion import Motion
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import OMEGA, THETA, V_OF_Z, X_OF_Z
from rbstab.systems.coordinates import CentreCoordinates
from rbstab.systems.modes import with_modes_at
from rbstab.systems.system import System

LARGEST_ANGLE = 1.0
"""rad; the angles of random states lie between plus and minus this."""


class Sample(NamedTuple):
    """A system of a body and the element, in the modes of a state, with this state.

    Attributes:
        number: Its number, from 1.
        system: The system, with random parameters.
        y: The state: Z, then the own states.
    """

    number: int
    system: System
    y: Array

    @property
    def element(self) -> Any:
        """The element."""
        return self.system.elements[0]

    @property
    def motion(self) -> Motion:
        """The motion at the state."""
        return self.system.motion(self.y)

    @property
    def element_states(self) -> Array:
        """The own states of the element."""
        return element_states_in(self.system, self.y)

    @property
    def stored_slopes(self) -> Array:
        """The derivatives of the stored energy by the entries of y, by complex steps."""
        return jacobian(lambda y: statements(self.system, y)["stored"][0], self.y)

    @property
    def words(self) -> str:
        """The state and the parameters of the element, for a message."""
        places = {"Θ": THETA, "Ω": OMEGA, "X": X_OF_Z, "V": V_OF_Z}
        places |= {name.partition(".")[2]: at for name, at in self.system.own_states.items()}
        by_name = {name: self.y[place] for name, place in places.items()}
        by_name |= {gain.name: getattr(self.element, gain.name) for gain in self.element.gains}
        parts = []
        for name, value in by_name.items():
            text = np.array2string(np.asarray(value, dtype=float), precision=4, separator=", ")
            parts.append(f"{name} = {' '.join(text.split())}")
        return f"state {self.number}: {', '.join(parts)}"

    def at(self, y: Array) -> "Sample":
        """Return a sample with another state, in its modes."""
        return self._replace(system=with_modes_at(self.system, y), y=y)

    def in_modes(self, modes: Array) -> "Sample":
        """Return a sample with other modes of its element."""
        element = replace(self.element, mode=modes)
        return self._replace(system=replace(self.system, elements=(element,)))

    @property
    def resting(self) -> "Sample":
        """The sample with a body at rest, in the same modes."""
        y = self.y.copy()
        y[OMEGA] = y[V_OF_Z] = 0.0
        return self._replace(y=y)


def element_states_in(system: System, y: Array) -> Array:
    """Return the own states of the element of a system in a state of any kind of number."""
    return y[system.coordinates.size :]


def statements(system: System, y: Array, time: float = 0.0) -> dict[str, Array]:
    """Return all that the first element of a system states at a state and a time, by name.

    Args:
        system: The system.
        y: The state, of any kind of number.
        time: The time, s.
    """
    element, motion = system.elements[0], system.motion(y, time)
    element_states = element_states_in(system, y)
    # The others may depend on the time through the rates alone, so these come first.
    stated = {"rates": element.rates(motion, element_states)} if element.state_size else {}
    stated["wrench"] = np.concatenate(element.wrench(motion, element_states))
    stated["stored"] = np.array([element.stored(motion, element_states)])
    stated["dissipated"] = np.array([element.dissipated(motion, element_states)])
    if element.mode_count:
        stated["guards"] = element.guards(motion, element_states)
    return stated


def samples_of(kind: Any, count: int) -> list[Sample]:
    """Return random samples of an element; the same in every call.

    Args:
        kind: The class of the element.
        count: How many.
    """
    samples = []
    for number in range(1, count + 1):
        rng = np.random.default_rng(number)
        gains = {gain.name: _random_gain(rng, gain) for gain in kind.gains}
        modes = {"mode": np.zeros(kind.mode_count)} if kind.mode_count else {}
        body = Body(float(rng.uniform(0.5, 2.0)), _positive_definite(rng), rng.normal(size=3))
        element: Element = kind(name="element", **gains, **modes)
        system = System(body, (element,), CentreCoordinates(), ZERO.copy())
        y = rng.normal(size=system.size)
        y[THETA] = rng.uniform(-LARGEST_ANGLE, LARGEST_ANGLE, 3)
        samples.append(Sample(number, system, y).at(y))
    return samples


def _random_gain(rng: np.random.Generator, gain: Gain) -> Any:
    """Return a random value of the shape and the definiteness that a gain declares."""
    if gain.shape == "matrix":
        root = rng.normal(size=(3, 3))
        return _positive_definite(rng) if gain.positive else root + root.T
    if gain.shape == "direction":
        direction = rng.normal(size=3)
        return direction / np.linalg.norm(direction)
    size = 3 if gain.shape == "diagonal" else None
    bound = gain.below if gain.below is not None else gain.at_most
    if bound is not None:
        return bound * float(rng.uniform(0.2, 0.8))
    positive = gain.positive or gain.default is not None
    values = rng.uniform(0.5, 2.0, size) if positive else rng.normal(size=size)
    return values if size else float(values)


def _positive_definite(rng: np.random.Generator) -> Array:
    root = rng.normal(size=(3, 3))
    return root @ root.T + 0.5 * np.eye(3)
