"""From a config to the problem that it describes."""

from typing import Any

import numpy as np

from rbstab.config.controllers import BoundaryLayer, Implicit, SlidingController, Slope
from rbstab.config.schema import Baumgarte, Config
from rbstab.elements.element import Element
from rbstab.elements.embedded import EmbeddedConnector
from rbstab.elements.gravity import Gravity
from rbstab.elements.rotational_stabilizer import RotationalStabilizer
from rbstab.elements.sliding import SlidingConnector
from rbstab.elements.translational_stabilizer import TranslationalStabilizer
from rbstab.elements.visco_elastic import ViscoElasticConnector
from rbstab.integrate.problem import Problem, Switching
from rbstab.mechanics.algebra import ZERO, inverse
from rbstab.mechanics.body import Body, triangle_violation
from rbstab.mechanics.motion import motion_from_centre, motion_from_contact
from rbstab.mechanics.numbers import Array
from rbstab.systems.coordinates import (
    CentreCoordinates,
    ContactCoordinates,
    Coordinates,
    ManifoldCoordinates,
    ReducedCoordinates,
)
from rbstab.systems.system import System


def problem_of(config: Config) -> Problem:
    """The initial value problem of a config."""
    integration: Any = config.integration
    # A load beyond all numbers becomes infinite, and the run a diverged one.
    with np.errstate(all="ignore"):
        system = system_of(config)
        start = _start(config, system)
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
    )


def system_of(config: Config) -> System:
    """The system of a config: body, gravity, the two stabilizers, and the connector if any."""
    controller = config.controller
    mass = config.body.mass
    body = Body(mass, _matrix(config.body.inertia), np.array(config.body.contact_point))
    weight = mass * np.array(config.gravity)
    K_t = _matrix(controller.K_t)
    elements: list[Element] = [
        Gravity(weight),
        TranslationalStabilizer(K_t, _matrix(controller.L_t)),
        RotationalStabilizer(_matrix(controller.K_r), _matrix(controller.L_r)),
        *_connector(controller),
    ]
    # X_e = K_t⁻¹ G is where the loaded translational stabilizer holds the centre at Θ = 0 (5.1).
    at_equilibrium = getattr(controller, "anchor", "origin") == "equilibrium"
    anchor = inverse(K_t) @ weight if at_equilibrium else ZERO.copy()
    return System(body, tuple(elements), _coordinates(config.integration), anchor)


def config_warnings(config: Config) -> list[str]:
    """What is odd about a config, though it can be run."""
    found = []
    moments = triangle_violation(_matrix(config.body.inertia))
    if moments is not None:
        large, middle, small = moments
        found.append(
            f"body.inertia: no real body has the principal moments {large:g}, {middle:g}, {small:g}"
            f" kg m²: {large:g} > {middle:g} + {small:g} breaks the triangle inequality"
        )
    law = getattr(config.controller, "law", None)
    if isinstance(law, Implicit):
        spacing = config.integration.duration / (config.integration.samples - 1)
        if law.implicit > spacing:
            found.append(
                f"controller.law: implicit steps of {law.implicit:g} s are longer than the samples "
                f"are apart; steps of {spacing:g} s are made"
            )
        found.append(
            f"controller.law: implicit steps of {law.implicit:g} s damp the motion numerically; "
            "discarded_energy is what they take on s = E, and when it sticks depends on them"
        )
    return found


def _matrix(value: Any) -> Array:
    array = np.array(value)
    return np.diag(array) if array.ndim == 1 else array


def _connector(controller: Any) -> list[Element]:
    if controller.variant == "visco-elastic":
        return [ViscoElasticConnector(_matrix(controller.K_c), _matrix(controller.L_c))]
    if controller.variant == "embedded":
        gains = (controller.K_c, controller.L_c, controller.K_d, controller.L_d)
        return [EmbeddedConnector(*(_matrix(gain) for gain in gains))]
    if controller.variant == "sliding":
        return [_sliding_connector(controller)]
    return []


def _sliding_connector(controller: SlidingController) -> SlidingConnector:
    surface, law = controller.surface, controller.law
    on_position = surface == "position"
    return SlidingConnector(
        K_s=np.array(controller.K_s),
        rate_weight=0.0 if on_position else 1.0,
        slope=surface.slope if isinstance(surface, Slope) else 1.0,
        mode=np.zeros(3),
        layer=np.zeros(3),
        layer_width=law.boundary_layer if isinstance(law, BoundaryLayer) else 1.0,
    )


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
    drift_control = getattr(integration, "drift_control", "none")
    rate = drift_control.baumgarte if isinstance(drift_control, Baumgarte) else 0.0
    choices: dict[str, Coordinates] = {
        "Z": CentreCoordinates(),
        "W": ContactCoordinates(),
        "reduced": ReducedCoordinates(),
        "manifold": ManifoldCoordinates(rate),
    }
    return choices[integration.coordinates]


def _start(config: Config, system: System) -> Array:
    initial: Any = config.initial
    Theta, Omega = np.array(initial.orientation), np.array(initial.angular_velocity)
    if system.coordinates.holds_contact:
        W = np.concatenate([Theta, Omega, ZERO, ZERO])
        motion = motion_from_contact(system.body, system.anchor, W)
    else:
        Z = np.concatenate([Theta, Omega, initial.position, initial.velocity])
        motion = motion_from_centre(system.body, system.anchor, Z)
    return system.start(motion, np.array(getattr(initial, "connector_state", ())))
