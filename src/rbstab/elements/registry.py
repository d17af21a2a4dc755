"""The list of all elements: gravity, stabilizers and connectors.

A new connector needs one file, one line in `CONNECTORS`, and an example config. Its variant in
configs, schema, sweeps, files and reports follows from its declarations. A new kind of element
needs one file and its line in `KINDS`.
"""

from typing import Any, NamedTuple

import numpy as np

from rbstab.elements.attitude_spring import AttitudeSpring
from rbstab.elements.coactivated import CoactivatedTie
from rbstab.elements.element import Element
from rbstab.elements.embedded import EmbeddedConnector, EmbeddedTie
from rbstab.elements.gravity import Gravity
from rbstab.elements.guards.barrier import Barrier
from rbstab.elements.guards.soft_guards import RepellingGuard, StiffGuard
from rbstab.elements.guards.stop import Stop
from rbstab.elements.inputs.loads import (
    BodyCoupleInput,
    BodyForceInput,
    ConstantForce,
    CoupleInput,
    ForceInput,
)
from rbstab.elements.ligament import Ligament
from rbstab.elements.motors import (
    HardConnector,
    HardCouple,
    HardForce,
    HardTie,
    LaggedConnector,
    LaggedCouple,
    LaggedForce,
    LaggedTie,
    LateConnector,
    LateCouple,
    LateForce,
    LateTie,
    Limited,
    LimitedBodyCouple,
    LimitedConnector,
    LimitedCouple,
    LimitedEmbeddedConnector,
    LimitedEmbeddedTie,
    LimitedForce,
    LimitedTie,
    Motor,
)
from rbstab.elements.rotational_stabilizer import RotationalStabilizer
from rbstab.elements.sliding import (
    CrossingTie,
    FilippovTie,
    LayeredTie,
    SlidingConnector,
    SlidingTie,
)
from rbstab.elements.spring import Spring, ZeroLengthSpring
from rbstab.elements.translational_stabilizer import TranslationalStabilizer
from rbstab.elements.visco_elastic import ViscoElasticConnector, ViscoElasticTie

STABILIZERS: tuple[type[Element], ...] = (TranslationalStabilizer, RotationalStabilizer)
"""The elements of every controller."""

CONNECTORS: dict[str, type[Element]] = {
    "visco-elastic": ViscoElasticConnector,
    "embedded": EmbeddedConnector,
    "sliding": SlidingConnector,
}
"""The connectors by variant; other variants have no connector."""

ELEMENTS: tuple[type[Element], ...] = (Gravity, *STABILIZERS, *CONNECTORS.values())
"""All elements."""

KINDS: dict[str, dict[str | None, type[Element]]] = {
    "spring": {None: Spring},
    "visco-elastic": {None: ViscoElasticTie},
    "embedded": {None: EmbeddedTie},
    "sliding": {None: SlidingTie},
    "coactivated": {None: CoactivatedTie},
    "attitude": {None: AttitudeSpring},
    "ligament": {None: Ligament},
    "guard": {
        "barrier": Barrier,
        "stiff": StiffGuard,
        "repelling": RepellingGuard,
        "stop": Stop,
    },
    "input": {
        "force": ForceInput,
        "body_force": BodyForceInput,
        "couple": CoupleInput,
        "body_couple": BodyCoupleInput,
    },
}
"""The kinds of elements that a config may have any number of, each with a name of its own. A kind
has one class, or several of which a key of its config chooses one (`SELECTORS`)."""


class Motors(NamedTuple):
    """The classes of one kind of motors: with a limit, a lag, and a lag that is too long.

    Where a config allows a smooth limit alone, it stands for the others.
    """

    smooth: type[Limited]
    hard: type[Limited]
    lagged: type[Motor]
    late: type[Motor]


OF_FORCE = Motors(LimitedForce, HardForce, LaggedForce, LateForce)
OF_COUPLE = Motors(LimitedCouple, HardCouple, LaggedCouple, LateCouple)

OF_TIES: dict[type[Element], Motors] = {
    ViscoElasticConnector: Motors(LimitedConnector, HardConnector, LaggedConnector, LateConnector),
    ViscoElasticTie: Motors(LimitedTie, HardTie, LaggedTie, LateTie),
    EmbeddedConnector: Motors(*[LimitedEmbeddedConnector] * 4),
    EmbeddedTie: Motors(*[LimitedEmbeddedTie] * 4),
}
"""The motors of connectors and ties."""

OF_CONTROLLER: tuple[type[Element], ...] = (
    *(LimitedForce, LimitedCouple, LaggedForce, LaggedCouple),
    *(LimitedConnector, LaggedConnector),
)
"""The motors of a controller, for their declarations."""

SELECTORS = {"guard": "method", "input": "quantity"}
"""The key that chooses the class, for each kind with several."""

SLIDING_TIES: dict[str, type[SlidingTie]] = {
    "position": CrossingTie,
    "slope": FilippovTie,
    "layer": LayeredTie,
}
"""The classes of the kind `sliding`, by the surface or `layer`."""

NAMED_ELEMENTS = tuple(element for methods in KINDS.values() for element in methods.values())
"""The classes of all kinds."""


def element_of(section: Any) -> type[Element]:
    """Return the class of an element of a config.

    Args:
        section: Its `kind` is a key of `KINDS`; it has a selector if the kind has several classes.
            A sliding tie has its `form` instead, a key of `SLIDING_TIES`. A spring without rest
            length and damping has formulas of its own; the general ones hold for it too, so they
            are taken where one of these numbers varies. A force that never changes is no input.
    """
    if section.kind == "sliding":
        return SLIDING_TIES[section.form]
    if section.kind == "spring" and _is_zero(section.rest_length, section.damping):
        return ZeroLengthSpring
    element_class = KINDS[section.kind][selected(section)]
    if element_class in OF_TIES:
        return _with_motors(element_class, section, section.actuators)
    if element_class is ForceInput and section.signal.kind == "constant":
        return ConstantForce
    return element_class


def _is_zero(*values: Any) -> bool:
    """Return whether numbers are zero; one with tolerances, whose `constant` is None, is not."""
    return all(getattr(value, "constant", value) == 0 for value in values)


def selected(section: Any) -> str | None:
    """Return the value of the selector of an element of a config; None if its kind has none."""
    return getattr(section, SELECTORS.get(section.kind, ""), None)


def stabilizers_of(controller: Any) -> tuple[type[Element], ...]:
    """Return the classes of the stabilizers of a controller of a config."""
    actuators = getattr(controller, "actuators", None)
    if actuators is None:
        return STABILIZERS if hasattr(controller, "K_t") else ()
    limit, lag = actuators.limit, actuators.lag
    H, N = STABILIZERS
    if lag is not None:
        H = _with_lag(OF_FORCE, controller.K_t, controller.L_t, lag) or H
        N = _with_lag(OF_COUPLE, controller.K_r, controller.L_r, lag) or N
    elif limit is not None:
        H = getattr(OF_FORCE, actuators.law) if limit.H else H
        of_N = LimitedBodyCouple if actuators.axes == "body" else getattr(OF_COUPLE, actuators.law)
        N = of_N if limit.N else N
    return H, N


def connector_of(controller: Any) -> type[Element] | None:
    """Return the class of the connector of a controller of a config; None without a connector."""
    connector = CONNECTORS.get(getattr(controller, "variant", ""))
    if connector not in OF_TIES:
        return connector
    return _with_motors(connector, controller, controller.connector_actuators)


def _with_motors(kind: type[Element], section: Any, actuators: Any) -> type[Element]:
    """Return the class of a connector or tie with its motors, if it has some."""
    if actuators is None:
        return kind
    motors = OF_TIES[kind]
    if actuators.lag is None:
        limited: type[Element] = getattr(motors, actuators.law)
        return limited
    return _with_lag(motors, section.K_c, section.L_c, actuators.lag) or kind


def _with_lag(motors: Motors, K: Any, L: Any, lag: Any) -> type[Motor] | None:
    """Return the class of motors with a lag, as it is passive or not; None for K = L = 0."""
    if not (np.any(K) or np.any(L)):
        return None
    return motors.lagged if longest_lag(K, L) > np.real(lag) else motors.late


def longest_lag(K: Any, L: Any) -> float:
    """Return the largest τ for which L - τK is positive semidefinite, s; 0 if L is singular.

    With a shorter lag a motor is passive. It is the least eigenvalue of K⁻¹L.

    Args:
        K: Stiffness: three numbers, or the rows of a matrix.
        L: Damping, in one of these forms.
    """
    K, L = (np.real(np.diag(M) if np.ndim(M) == 1 else np.array(M)) for M in (K, L))
    scale, axes = np.linalg.eigh(L)
    if scale[0] <= 0:
        return 0.0
    # With y = √L x: y'y - τ y'(L^-½ K L^-½) y.
    root = axes / np.sqrt(scale)
    largest = float(np.linalg.eigvalsh(root.T @ K @ root)[-1])
    return 1.0 / largest if largest > 0 else np.inf


GAINS = {gain.place: gain for element in (*ELEMENTS, *OF_CONTROLLER) for gain in element.gains}
"""All gains of a controller by their keys, in the order of the elements."""

OWN_STATES = {state.name: state for element in ELEMENTS for state in element.states}
"""The own states of the connectors, by name. Those of named elements, and of motors, have a dot in
their names (`Element.own_states`)."""
