"""Keys of a config as users write them, such as `initial.orientation.deg[1]`, and their units.

A key has one unit: SI, or degrees if it ends in `.deg`.
"""

import re
from collections.abc import Iterable
from math import radians
from typing import Any, NamedTuple

from rbstab.config.sections.signals import SIGNAL_UNITS
from rbstab.config.source import Path, key_of
from rbstab.config.user_code.section import KIND as PYTHON
from rbstab.config.user_code.section import PARAMETERS, parameter_units, parameters_in
from rbstab.elements.motors import LAG
from rbstab.elements.registry import GAINS, KINDS, OWN_STATES, SELECTORS

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
        "bound.couple": "N m",
        "bound.force": "N",
        "bound.point": "m",
        "bound.tilt": "rad",
    }
    | {f"controller.{place}": gain.unit for place, gain in GAINS.items()}
    | {f"initial.{name}": state.unit for name, state in OWN_STATES.items()}
)

DEGREES = "deg"
"""The key of angles in degrees: `{deg: [30, 0, 0]}`."""

_IN_DEGREES = {"rad": "deg", "rad/s": "deg/s"}
"""The units of keys that end in `.deg`, by the units of the keys without it."""


def unit_of(key: str, elements: Iterable[Any] = ()) -> str:
    """Return the unit of a config key such as `body.inertia`; no code of a user runs.

    That of an angle in degrees, such as `initial.orientation.deg`, is `deg` or `deg/s`.

    Args:
        key: The key.
        elements: The data of the element in a key such as `elements.strut.stiffness`: one, or more
            if several configs have an element of that name.

    Returns:
        The unit. It is empty for keys without a unit, for a boundary layer, whose unit depends on
        the surface, and if the elements have different units.
    """
    elements = list(elements)
    whole, _, last = key.rpartition(".")
    if last == DEGREES and (unit := _IN_DEGREES.get(unit_of(whole, elements))):
        return unit
    section, _, rest = key.partition(".")
    if section != "elements":
        return _UNITS.get(key, "")
    gain = rest.partition(".")[2]
    if gain.startswith("signal."):
        return SIGNAL_UNITS.get(gain.removeprefix("signal."), "")
    units = {_units_in(element).get(gain, "") for element in elements}
    return units.pop() if len(units) == 1 else ""


def _units_in(element: Any) -> dict[str, str]:
    """Return the units of an element in the data of a config, by key; none if it is wrong."""
    try:
        kind = element["kind"]
        if kind == PYTHON:
            return {f"{PARAMETERS}.{name}": unit for name, unit in parameters_in(element).items()}
        declared = KINDS[kind][element.get(SELECTORS.get(kind))]
    except (AttributeError, KeyError, TypeError):
        return {}
    # Keys of sliding ties, and of ties with motors.
    others = {"surface.slope": "1/s", "actuators.limit": "N", LAG.place: LAG.unit}
    return parameter_units(declared) | others


_KEY_PART = re.compile(r"([A-Za-z_][A-Za-z0-9_]*)|\[([0-9]{1,6})\]")


class NumberKey(NamedTuple):
    """A key as a user writes it: the path of its numbers, and whether it ends in `.deg`."""

    path: Path
    degrees: bool = False

    @property
    def text(self) -> str:
        """The key as it is written."""
        names = names_in(self.path)
        return key_of((*names, DEGREES, *self.path[len(names) :]) if self.degrees else self.path)

    @property
    def factor(self) -> float:
        """The SI value of a number 1 at this key."""
        return radians(1.0) if self.degrees else 1.0


def in_degrees(key: NumberKey) -> tuple[str, str]:
    """Return what is wrong with a key in radians of a value that is in degrees, and what to write.

    Without the refusal, 90 for a rate of 90 degrees per second would mean 90 rad/s.
    """
    right = key._replace(degrees=True).text
    return "is in radians, but the config gives degrees", f"expected {right}"


def number_key(text: str) -> NumberKey | None:
    """Return what a text says as a key, or None if it is not a key."""
    path = parse_key(text)
    if path is None:
        return None
    names = names_in(path)
    # A gain of a user may have this name.
    if len(names) < 3 or names[-1] != DEGREES or names[-2] == PARAMETERS:
        return NumberKey(path)
    return NumberKey((*names[:-1], *path[len(names) :]), degrees=True)


def parse_key(text: str) -> Path | None:
    """Return the path of a dotted key (the inverse of `key_of`), or None if it is not a key."""
    path: list[str | int] = []
    for match in _KEY_PART.finditer(text):
        word, index = match.groups()
        path.append(word if word is not None else int(index))
    return tuple(path) if path and key_of(tuple(path)) == text else None


def names_in(path: Path) -> Path:
    """Return a path without the indices at its end."""
    return tuple(part for part in path if isinstance(part, str))
