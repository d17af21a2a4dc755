"""Units of the config keys."""

from collections.abc import Mapping

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

_ELEMENT_UNITS = {
    (kind, gain.name): gain.unit for kind, element in KINDS.items() for gain in element.gains
}


def unit_of(key: str, kinds: Mapping[str, str] | None = None) -> str:
    """Return the unit of a config key such as `body.inertia`.

    Args:
        key: The key.
        kinds: The kinds of the elements of the config, by name.

    Returns:
        The unit. It is empty for keys without a unit, and for a boundary layer, whose unit depends
        on the surface.
    """
    section, _, rest = key.partition(".")
    if section != "elements":
        return _UNITS.get(key, "")
    name, _, gain = rest.partition(".")
    kind = (kinds or {}).get(name, "")
    return _ELEMENT_UNITS.get((kind, gain), "")
