"""Units of the config keys."""

from collections.abc import Collection

from rbstab.config.inputs.signals import SIGNAL_UNITS
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

KindAndMethod = tuple[str, str | None]
"""The kind of an element, and the value of its selector (`registry.SELECTORS`) if it has one."""


def unit_of(key: str, kinds: Collection[KindAndMethod] = ()) -> str:
    """Return the unit of a config key such as `body.inertia`.

    Args:
        key: The key.
        kinds: The kinds of the element in a key such as `elements.strut.stiffness`, with their
            selectors: one, or more if several configs have an element of that name.

    Returns:
        The unit. It is empty for keys without a unit, for a boundary layer, whose unit depends on
        the surface, and if the kinds have different units.
    """
    section, _, rest = key.partition(".")
    if section != "elements":
        return _UNITS.get(key, "")
    gain = rest.partition(".")[2]
    if gain.startswith("signal."):
        return SIGNAL_UNITS.get(gain.removeprefix("signal."), "")
    units = {_ELEMENT_UNITS.get((*kind, gain), "") for kind in kinds}
    return units.pop() if len(units) == 1 else ""
