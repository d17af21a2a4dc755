"""The list of all elements: gravity, stabilizers and connectors.

A new connector needs one file, one line in `CONNECTORS`, and an example config. Its variant in
configs, schema, sweeps, files and reports follows from its declarations.
"""

from rbstab.elements.attitude_spring import AttitudeSpring
from rbstab.elements.barrier import Barrier
from rbstab.elements.element import Element
from rbstab.elements.embedded import EmbeddedConnector
from rbstab.elements.gravity import Gravity
from rbstab.elements.rotational_stabilizer import RotationalStabilizer
from rbstab.elements.sliding import SlidingConnector
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

KINDS: dict[str, type[Element]] = {
    "spring": Spring,
    "visco-elastic": ViscoElasticTie,
    "attitude": AttitudeSpring,
    "guard": Barrier,
}
"""The kinds of elements that a config may have any number of, each with a name of its own."""

GAINS = {gain.name: gain for element in ELEMENTS for gain in element.gains}
"""All gains by name, in the order of the elements."""

OWN_STATES = {state.name: state for element in ELEMENTS for state in element.states}
"""All own states by name."""
