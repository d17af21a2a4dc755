"""Units of the config keys."""

from collections.abc import Collection
from typing import NamedTuple

from rbstab.config.inputs.signals import SIGNAL_UNITS
from rbstab.config.user_code.section import PARAMETERS, parameters_in
from rbstab.elements.registry import GAINS, KINDS, OWN_STATES

_UNITS = (
    {
        "body.mass": "kg",
        "body.inertia": "kg m^2",
        "body.contact_point": "m",
        "gravity": "m/s^2",
        "controller.surface.slope": "1/s",
        "controller.law.implicit": "s",
        "controller.stick_energy": "J",
        "initial.orientation": "rad",
        "initial.angular_velocity": "rad/s",
        "initial.position": "m",
        "initial.velocity": "m/s",
    }
    | {f"controller.{name}": gain.unit for name, gain in GAINS.items()}
    | {f"initial.{name}": state.unit for name, state in OWN_STATES.items()}
)

_ELEMENT_UNITS = (
    {
        (kind, method, gain.name): gain.unit
        for kind, methods in KINDS.items()
        for method, element in methods.items()
        for gain in element.gains
    }
    | {
        (kind, method, state.initial_key): state.unit
        for kind, methods in KINDS.items()
        for method, element in methods.items()
        for state in element.states
    }
    | {("sliding", None, "surface.slope"): "1/s"}
)
"""By kind, selector and key: the stiffness of a spring and that of a guard have different units."""


DEGREES = "deg"
"""The key of angles in degrees: `{deg: [30, 0, 0]}`."""

_IN_DEGREES = {"rad": "deg", "rad/s": "deg/s"}
"""The units of keys that end in `.deg`, by the units of the keys without it."""


class Kind(NamedTuple):
    """What decides the units of an element of a config.

    Attributes:
        kind: Its kind.
        selected: The value of its selector (`registry.SELECTORS`), if the kind has several classes.
        source: The text of the file of an element of a user.
        class_name: The class in this text.
    """

    kind: str
    selected: str | None = None
    source: str | None = None
    class_name: str | None = None


def unit_of(key: str, kinds: Collection[Kind | tuple[str, str | None]] = ()) -> str:
    """Return the unit of a config key such as `body.inertia`; no code of a user runs.

    That of an angle in degrees, such as `initial.orientation.deg`, is `deg` or `deg/s`.

    Args:
        key: The key.
        kinds: The kinds of the element in a key such as `elements.strut.stiffness`: one, or more if
            several configs have an element of that name.

    Returns:
        The unit. It is empty for keys without a unit, for a boundary layer, whose unit depends on
        the surface, and if the kinds have different units.
    """
    whole, _, last = key.rpartition(".")
    if last == DEGREES and (unit := _IN_DEGREES.get(unit_of(whole, kinds))):
        return unit
    section, _, rest = key.partition(".")
    if section != "elements":
        return _UNITS.get(key, "")
    gain = rest.partition(".")[2]
    if gain.startswith("signal."):
        return SIGNAL_UNITS.get(gain.removeprefix("signal."), "")
    units = {_element_unit(Kind(*kind), gain) for kind in kinds}
    return units.pop() if len(units) == 1 else ""


def _element_unit(kind: Kind, key: str) -> str:
    if kind.source is None or kind.class_name is None:
        return _ELEMENT_UNITS.get((kind.kind, kind.selected, key), "")
    element = {"source": kind.source, "class": kind.class_name}
    named = {f"{PARAMETERS}.{name}": unit for name, unit in parameters_in(element).items()}
    return named.get(key, "")
