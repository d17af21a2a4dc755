"""The list of all elements: gravity, stabilizers and connectors.

A new connector needs one file, one line in `CONNECTORS`, and an example config. Its variant in
configs, schema, sweeps, files and reports follows from its declarations. A new kind of element
needs one file and its line in `KINDS`.
"""

from typing import Any

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
    found = KINDS[section.kind][selected(section)]
    if found is ForceInput and section.signal.kind == "constant":
        return ConstantForce
    return found


def _is_zero(*values: Any) -> bool:
    """Return whether numbers are zero; one with tolerances, whose `constant` is None, is not."""
    return all(getattr(value, "constant", value) == 0 for value in values)


def selected(section: Any) -> str | None:
    """Return the value of the selector of an element of a config; None if its kind has none."""
    return getattr(section, SELECTORS.get(section.kind, ""), None)


GAINS = {gain.name: gain for element in ELEMENTS for gain in element.gains}
"""All gains by name, in the order of the elements."""

OWN_STATES = {state.name: state for element in ELEMENTS for state in element.states}
"""The own states of the connectors, by name. Those of named elements: `Element.own_states`."""
