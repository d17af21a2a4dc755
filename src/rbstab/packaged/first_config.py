"""The first config of a new user: one for each variant, with a comment for each number."""

from rbstab.config.schema import VARIANTS, model_of
from rbstab.elements.declarations import Gain
from rbstab.elements.element import Element
from rbstab.elements.registry import CONNECTORS, STABILIZERS

COLUMN = 40
"""The comments of values begin here."""

VALUES = {
    "K_t": "[4100, 4100, 3280]",
    "L_t": "[200, 200, 140]",
    "K_r": "[400, 400, 320]",
    "L_r": "[60, 60, 42]",
    "K_c": "[12300, 12300, 9840]",
    "L_c": "[600, 600, 420]",
    "K_d": "[12300, 12300, 9840]",
    "L_d": "[1200, 1200, 840]",
    "K_s": "[20000, 20000, 20000]",
}
"""The gains of the paper's cases, by name."""

_OF_SHAPE = {"matrix": "[1000, 1000, 1000]", "diagonal": "[1000, 1000, 1000]", "number": "1000"}
"""The value of a gain that is not listed."""

CONNECTIONS = {
    "free": "its contact point C is free",
    "permanent": "its contact point C is held in place",
    "visco-elastic": "springs and dampers tie its contact point C to an anchor",
    "embedded": "a connector with a state of its own ties its contact point C to an anchor",
    "sliding": "a sliding-mode connector pulls its contact point C to an anchor",
}
"""What each variant does to the body."""

_HEAD = """\
# An experiment: one rigid body on two stabilizers, which pull it to the origin and upright.
# Variant {variant}: {connection}.
# Every number is yours to change. Units are SI; angles are in radians.
schema_version: 2                       # of the keys below; 2 may also have `elements`
title: My first experiment

# The body: a solid cylinder, 0.84 m long and 0.24 m wide. Body coordinates begin at its centre of
# gravity. C is the middle of its lower face.
body:
  mass: 41.0                            # kg
  inertia: [2.5584, 2.5584, 0.2952]     # kg m^2: three principal moments, or a 3x3 matrix
  contact_point: [0, 0, -0.42]          # m, from the centre of gravity to C
# gravity: [0, 0, -9.81]                # m/s^2, along the axes of space; without the line: none

# What acts on the body. Each gain is three numbers, one for each axis, or a 3x3 matrix.
controller:
  variant: {variant:<29}# one of {variants}
"""

_ANCHOR = """\
  anchor: origin                        # or equilibrium: where the body rests under gravity
"""

_SURFACE = """\
  surface: {slope: 20}                  # 1/s: it slides on F + 20 E = 0, or position: on E = 0
"""

_TAIL = """\

# The state at the start. What is left out is zero.
initial:
  orientation: [0.2, 0.1, 0]            # rad: the Euler angles; in degrees: {{deg: [11, 6, 0]}}
  angular_velocity: [2, -3, 5]          # rad/s, body coordinates
{more}
integration:
  duration: 3.0                         # s
  samples: 401                          # equally spaced instants that are stored
"""

_FREE_START = """\
  position: [0.02, 0, 0]                # m, of the centre of gravity; or, in place of this line,
  # attached: true                      # C starts on its anchor: the position follows
  velocity: [0, 0, 0]                   # m/s
"""


def first_config(variant: str) -> str:
    """Return the text of a config of a variant; it is valid as it is.

    Raises:
        KeyError: There is no such variant.
    """
    model = model_of(variant).model_fields
    connector = CONNECTORS.get(variant)
    elements = (*STABILIZERS, *((connector,) if connector is not None else ()))
    connection = CONNECTIONS.get(variant, f"the connector {variant} acts at its contact point C")
    head = _HEAD.format(connection=connection, variant=variant, variants=", ".join(VARIANTS))
    keys = getattr(model["controller"].annotation, "model_fields", {})
    special = (_ANCHOR if "anchor" in keys else "") + (_SURFACE if "surface" in keys else "")
    start = getattr(model["initial"].annotation, "model_fields", {})
    more = _FREE_START if "position" in start else ""
    return head + special + "".join(map(_gain_lines, elements)) + _TAIL.format(more=more)


def _gain_lines(element: type[Element]) -> str:
    """Return a line for each gain of an element."""
    return "".join(map(_gain_line, element.gains))


def _gain_line(gain: Gain) -> str:
    value = VALUES.get(gain.name, _OF_SHAPE[gain.shape])
    return f"{f'  {gain.name}: {value}':<{COLUMN}}# {gain.unit}: {gain.description}\n"
