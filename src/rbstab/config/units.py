"""Units of the config keys."""

from rbstab.elements.registry import GAINS, OWN_STATES

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


def unit_of(key: str) -> str:
    """Return the unit of a config key such as `body.inertia`.

    Returns:
        The unit. It is empty for keys without a unit, and for a boundary layer, whose unit depends
        on the surface.
    """
    return _UNITS.get(key, "")
