"""Building the initial value problem of a config, in doubles or any other kind of number."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from rbstab.config.controllers import BoundaryLayer, Implicit, SlidingController, Slope
from rbstab.config.elements import declarations_of, inputs, parameter
from rbstab.config.schema import Config
from rbstab.config.sections.integration import Baumgarte, HeldIntegration
from rbstab.config.user_code.permission import permitted_class
from rbstab.config.user_code.section import PythonElement
from rbstab.elements.element import Element
from rbstab.elements.gravity import Gravity
from rbstab.elements.inputs import legs
from rbstab.elements.inputs.signals import Constant, Driven, Leg, Signal, Sine
from rbstab.elements.motors import Lagged
from rbstab.elements.registry import connector_of, element_of, stabilizers_of
from rbstab.elements.sliding import Sliding
from rbstab.elements.spring import NO_LENGTH, Spring, squared_length
from rbstab.integrate.problem import Problem, Switching
from rbstab.mechanics.algebra import ZERO, inverse
from rbstab.mechanics.body import Body
from rbstab.mechanics.motion import (
    Motion,
    motion_from_centre,
    motion_from_contact,
    motion_on_anchor,
)
from rbstab.mechanics.numbers import Array, sqrt
from rbstab.systems.coordinates import (
    CentreCoordinates,
    ContactCoordinates,
    Coordinates,
    ManifoldCoordinates,
    ReducedCoordinates,
)
from rbstab.systems.filippov import at_start
from rbstab.systems.schedule import schedule_of
from rbstab.systems.system import System

Numbers = Callable[[Array], Array]
"""A function that converts an array of doubles to an array of a kind of number, in its shape."""

Convert = dict[str, Callable[[Any], Any]]
"""Functions that convert a config value to the field of an element, by the shape of a gain."""


def doubles(values: Array) -> Array:
    """Return the values: the kind of number of all runs."""
    return values


def problem_of(config: Config) -> Problem:
    """Return the initial value problem of a config."""
    integration: Any = config.integration
    # If the weight overflows, it becomes infinite; the run then ends as diverged.
    with np.errstate(all="ignore"):
        system = system_of(config)
        start = start_of(config, system)
        system = at_start(system, start)
    return Problem(
        system=system,
        start=start,
        times=np.linspace(0.0, integration.duration, integration.samples),
        rtol=integration.rtol,
        atol=integration.atol,
        method=integration.method,
        range_bound=integration.range_bound,
        project=getattr(integration, "drift_control", "none") == "projection",
        step_limit=integration.step_limit,
        time_limit=integration.time_limit,
        switching=_switching(config.controller),
        exact=partial(system_and_start, config),
        schedule=schedule_of(input_legs(config)),
        quaternion=integration.coordinates == "quaternion",
    )


def system_and_start(config: Config, numbers: Numbers = doubles) -> tuple[System, Array]:
    """Return the system, in any modes, and the initial state of a config in a kind of number."""
    system = system_of(config, numbers)
    return system, start_of(config, system, numbers)


def system_of(config: Config, numbers: Numbers = doubles) -> System:
    """Return the system of a config: body, gravity, controller and elements.

    Args:
        config: The config. If it has elements of users, their files are run.
        numbers: The kind of number of its parameters. All that follows from them, such as the
            weight, is computed with it. The settings of a sliding connector stay doubles.
    """
    controller, convert = config.controller, _conversions(numbers)
    body = body_of(config, numbers)
    weight = body.mass * convert["diagonal"](config.gravity)
    elements: list[Element] = [
        Gravity(weight),
        *(kind(**_gains(kind, controller, convert)) for kind in stabilizers_of(controller)),
        *_connector(controller, convert),
        *_elements(config, convert),
    ]
    # X_e = K_t⁻¹ G is the rest position of the centre of gravity under load at Θ = 0 (5.1).
    at_equilibrium = getattr(controller, "anchor", "origin") == "equilibrium"
    anchor = ZERO.copy()
    if at_equilibrium:
        anchor = inverse(convert["matrix"](controller.K_t)) @ weight
    return System(body, tuple(elements), _coordinates(config.integration), anchor)


def body_of(config: Config, numbers: Numbers = doubles) -> Body:
    """Return the body of a config, in a kind of number."""
    body, convert = config.body, _conversions(numbers)
    inertia, contact_point = (
        convert["matrix"](body.inertia),
        convert["diagonal"](body.contact_point),
    )
    return Body(convert["number"](body.mass), inertia, contact_point)


def supplies_power(config: Config) -> bool:
    """Return whether an element of a config supplies power. No code of users runs."""
    controller = config.controller
    kinds = [*stabilizers_of(controller), *map(declarations_of, config.elements.values())]
    return any(kind.supplies for kind in (*kinds, connector_of(controller) or Element))


def _matrix(value: Any) -> Array:
    array = np.array(value)
    return np.diag(array) if array.ndim == 1 else array


def _conversions(numbers: Numbers) -> Convert:
    """Return the conversions to a kind of number."""
    return {
        "matrix": lambda value: numbers(_matrix(value)),
        "diagonal": lambda value: numbers(np.array(value)),
        "number": lambda value: numbers(np.array(value))[()],
        "direction": lambda value: _direction(np.array(value), numbers),
    }


def _direction(vector: Array, numbers: Numbers) -> Array:
    """Return a vector divided by its length."""
    vector = vector if vector.dtype != object else numbers(vector)
    unit = vector / sqrt(vector @ vector)
    # Where its entries are plain numbers, the result means the decimals of this quotient: its
    # length has no exact decimals.
    return unit if vector.dtype == object else numbers(unit)


def _gains(element: type[Element], section: Any, convert: Convert) -> dict[str, Any]:
    """Return the gains of an element by name, as arrays or numbers."""
    return {
        gain.name: convert[gain.shape](parameter(section, gain.place)) for gain in element.gains
    }


def _connector(controller: Any, convert: Convert) -> list[Element]:
    """Return a list with the connector; it is empty for variants without a connector."""
    connector = connector_of(controller)
    if connector is None:
        return []
    settings = _surface_settings(controller) if issubclass(connector, Sliding) else {}
    return [connector(**_gains(connector, controller, convert), **settings)]


def _elements(config: Config, convert: Convert) -> list[Element]:
    """Return the elements of the config, in the order of their names."""
    elements: list[Element] = []
    for name, section in config.elements.items():
        if isinstance(section, PythonElement):
            kind: Any = permitted_class(name, section)
        else:
            kind = element_of(section)
        fields = {"name": name, **_gains(kind, section, convert)}
        if issubclass(kind, Driven):
            fields["signal"] = _signal(section.signal, config.integration.duration, convert)
        if issubclass(kind, Sliding):
            fields |= _surface_settings(section)
        elements.append(kind(**fields))
    return elements


def _signal(signal: Any, duration: float, convert: Convert) -> Signal:
    """Return a signal as it is at the start."""
    number = convert["number"]
    if signal.kind == "constant":
        return Constant()
    if signal.kind == "sine":
        return Sine(number(signal.frequency), number(signal.phase))
    return Leg(*(number(part) for part in _legs(signal, duration)[0].tolist()))


def _legs(signal: Any, duration: float) -> Array:
    """Return the legs of a signal that is made of them, shape (legs, 3)."""
    if signal.kind == "pulse":
        return legs.pulse(signal.start, signal.duration)
    if signal.kind == "ramp":
        return legs.ramp(signal.start, signal.duration)
    if signal.kind == "table":
        return legs.table(np.array(signal.times), np.array(signal.values))
    return legs.noise(signal.seed, signal.rate, signal.correlation_time, duration)


def input_legs(config: Config) -> dict[str, Array]:
    """Return the legs of all inputs that are made of them, each of shape (legs, 3), by name."""
    duration = config.integration.duration
    names = inputs(config.elements, with_legs=True)
    return {name: _legs(config.elements[name].signal, duration) for name in names}


def _surface_settings(section: Any) -> dict[str, Any]:
    """Return the surface and the layer of a sliding connector or tie."""
    surface, law = section.surface, section.law
    return {
        "rate_weight": 0.0 if surface == "position" else 1.0,
        "slope": surface.slope if isinstance(surface, Slope) else 1.0,
        "layer_width": law.boundary_layer if isinstance(law, BoundaryLayer) else 1.0,
    }


def _switching(controller: Any) -> Switching | None:
    if not isinstance(controller, SlidingController):
        return None
    return Switching(
        layered=isinstance(controller.law, BoundaryLayer),
        step=controller.law.implicit if isinstance(controller.law, Implicit) else 0.0,
        stick_energy=controller.stick_energy,
        switch_limit=controller.switch_limit,
        stored_switches=controller.stored_switches,
    )


def _coordinates(integration: Any) -> Coordinates:
    """Return the coordinates of the states of a config's problem; they have Θ."""
    drift_control = getattr(integration, "drift_control", "none")
    rate = drift_control.baumgarte if isinstance(drift_control, Baumgarte) else 0.0
    is_held = isinstance(integration, HeldIntegration)
    by_name: dict[str, Coordinates] = {
        "quaternion": ReducedCoordinates() if is_held else CentreCoordinates(),
        "Z": CentreCoordinates(),
        "W": ContactCoordinates(),
        "reduced": ReducedCoordinates(),
        "manifold": ManifoldCoordinates(rate),
    }
    return by_name[integration.coordinates]


def start_of(config: Config, system: System, numbers: Numbers = doubles) -> Array:
    """Return the initial state vector of a config, shape (system.size,).

    Args:
        config: The config.
        system: Its system, built with the same kind of number.
        numbers: The kind of number of the initial state.
    """
    return system.start(*start_motion(config, system, numbers))


def start_motion(
    config: Config, system: System, numbers: Numbers = doubles
) -> tuple[Motion, Array]:
    """Return the motion at the start of a config, and the own states of its elements.

    Args:
        config: The config.
        system: Its system, built with the same kind of number.
        numbers: The kind of number of the initial state.
    """
    initial: Any = config.initial

    def vector(name: str) -> Array:
        return numbers(np.array(getattr(initial, name)))

    Theta, Omega = vector("orientation"), vector("angular_velocity")
    if system.coordinates.holds_contact:
        W = np.concatenate([Theta, Omega, ZERO, ZERO])
        motion = motion_from_contact(system.body, system.anchor, W)
    elif initial.attached:
        V = vector("velocity")
        motion = motion_on_anchor(system.body, system.anchor, Theta, Omega, V)
    else:
        Z = np.concatenate([Theta, Omega, vector("position"), vector("velocity")])
        motion = motion_from_centre(system.body, system.anchor, Z)
    values = (value for element in system.elements for value in _initial_states(config, element))
    element_states = [numbers(np.array(value)) for value in values]
    return motion, np.concatenate([np.zeros(0), *element_states])


def springs_without_length(config: Config) -> dict[str, float]:
    """Return the lengths, m, of the springs of a config that have no direction at the start."""
    with np.errstate(all="ignore"):
        system = system_of(config)
        motion = system.motion(start_of(config, system))
        lengths = {
            element.name: float(sqrt(squared_length(motion, element.point, element.anchor)))
            for element in system.elements
            if isinstance(element, Spring)
        }
    rests = {name: config.elements[name].rest_length for name in lengths}
    return {name: at for name, at in lengths.items() if at <= NO_LENGTH * rests[name]}


def _initial_states(config: Config, element: Element) -> list[Any]:
    """Return the initial values of the own states of an element, in their order."""
    section = config.elements.get(element.name)
    if isinstance(element, Lagged):
        return [ZERO] * len(element.states)
    if section is None:
        return [getattr(config.initial, state.name) for state in element.states]
    return [parameter(section, state.initial_key) for state in element.states]
