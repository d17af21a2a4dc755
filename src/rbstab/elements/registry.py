"""The list of all elements: gravity, stabilizers and connectors.

A new connector needs one file, one line in `CONNECTORS`, and an example config. Its variant in
configs, schema, sweeps, files and reports follows from its declarations. A new kind of element
needs one file and its line in `KINDS`.
"""

from typing import Any

from rbstab.elements.attitude_spring import AttitudeSpring
from rbstab.elements.barrier import Barrier
from rbstab.elements.element import Element
from rbstab.elements.embedded import EmbeddedConnector, EmbeddedTie
from rbstab.elements.gravity import Gravity
from rbstab.elements.ligament import Ligament
from rbstab.elements.rotational_stabilizer import RotationalStabilizer
from rbstab.elements.sliding import SlidingConnector
from rbstab.elements.sliding_ties import CrossingTie, FilippovTie, LayeredTie, SlidingTie
from rbstab.elements.soft_guards import RepellingGuard, StiffGuard
from rbstab.elements.spring import Spring
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
    "attitude": {None: AttitudeSpring},
    "ligament": {None: Ligament},
    "guard": {"barrier": Barrier, "stiff": StiffGuard, "repelling": RepellingGuard},
}
"""The kinds of elements that a config may have any number of, each with a name of its own. A kind
has one class, or one for each `method` in its config."""

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
        section: Its `kind` is a key of `KINDS`; it has a `method` if the kind has several classes.
            A sliding tie has its `form` instead, a key of `SLIDING_TIES`.
    """
    if section.kind == "sliding":
        return SLIDING_TIES[section.form]
    return KINDS[section.kind][getattr(section, "method", None)]


GAINS = {gain.name: gain for element in ELEMENTS for gain in element.gains}
"""All gains by name, in the order of the elements."""

OWN_STATES = {state.name: state for element in ELEMENTS for state in element.states}
"""The own states of the connectors, by name. Those of named elements: `Element.own_states`."""
