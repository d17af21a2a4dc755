"""The list of all elements: gravity, stabilizers and connectors.

A new connector needs one file, one line in `CONNECTORS`, and an example config. Its variant in
configs, schema, sweeps, files and reports follows from its declarations.
"""

from rbstab.elements.element import Element
from rbstab.elements.embedded import EmbeddedConnector
from rbstab.elements.gravity import Gravity
from rbstab.elements.rotational_stabilizer import RotationalStabilizer
from rbstab.elements.sliding import SlidingConnector
from rbstab.elements.translational_stabilizer import TranslationalStabilizer
from rbstab.elements.visco_elastic import ViscoElasticConnector

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

GAINS = {gain.name: gain for element in ELEMENTS for gain in element.gains}
"""All gains by name, in the order of the elements."""

OWN_STATES = {state.name: state for element in ELEMENTS for state in element.states}
"""All own states by name."""
