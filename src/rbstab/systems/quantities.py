"""The quantities of a run: their names in files, symbols, units and equations."""

from collections.abc import Iterable
from typing import NamedTuple

from rbstab.elements.declarations import OwnState
from rbstab.elements.registry import OWN_STATES


class Quantity(NamedTuple):
    """A quantity of a run.

    Attributes:
        name: The name in result files.
        symbol: The symbol in the paper.
        unit: The SI unit; "1" for dimensionless quantities.
        dimensions: The dimensions of its array.
        meaning: The meaning, with frame and equation.
        optional: Whether only some variants or coordinates have it.
    """

    name: str
    symbol: str
    unit: str
    dimensions: tuple[str, ...]
    meaning: str
    optional: bool = False


_TIME = ("time",)
_VECTOR = ("time", "axis")
_BY_PART = ("time", "part")
_ERROR = "bound of its error; NaN: unknown, and it is that of the samples"


def state_quantity(state: OwnState) -> Quantity:
    """Return the quantity of an own state of an element."""
    dimensions = ("time", state.dimension)
    return Quantity(
        state.name, state.symbol, state.unit, dimensions, state.description, optional=True
    )


QUANTITIES = (
    Quantity("time", "t", "s", _TIME, "time from the start"),
    Quantity("orientation", "Θ", "rad", _VECTOR, "Euler angles, A = A1(θ1) A2(θ2) A3(θ3) (eq. 2)"),
    Quantity("angular_velocity", "Ω", "rad/s", _VECTOR, "angular velocity, body (eq. 1)"),
    Quantity("position", "X", "m", _VECTOR, "centre of gravity, inertial (eq. 1)"),
    Quantity(
        "velocity", "V", "m/s", _VECTOR, "velocity of the centre of gravity, inertial (eq. 1)"
    ),
    *map(state_quantity, OWN_STATES.values()),
    Quantity(
        "contact_displacement",
        "E",
        "m",
        _VECTOR,
        "contact point from its anchor, inertial (eq. 4, 38)",
    ),
    Quantity("contact_velocity", "F", "m/s", _VECTOR, "dE/dt, inertial (eq. 4)"),
    Quantity(
        "contact_force",
        "Λ",
        "N",
        _VECTOR,
        "force on the body at the contact point, inertial (eq. 15, 20, 22, 40)",
    ),
    Quantity(
        "stabilizing_force", "H", "N", _VECTOR, "force of the translational stabilizer (eq. 24)"
    ),
    Quantity(
        "stabilizing_couple",
        "N",
        "N m",
        _VECTOR,
        "couple of the rotational stabilizer, body (eq. 23)",
    ),
    Quantity(
        "element_force",
        "-",
        "N",
        ("time", "element", "axis"),
        "force of each element of the config, inertial",
        optional=True,
    ),
    Quantity(
        "element_couple",
        "-",
        "N m",
        ("time", "element", "axis"),
        "couple of each element of the config about the centre of gravity, body",
        optional=True,
    ),
    Quantity("lyapunov", "v", "J", _TIME, "Lyapunov function, sum of energy less energy_at_rest"),
    Quantity(
        "lyapunov_rate",
        "v'",
        "W",
        _TIME,
        "derivative of v, what is supplied minus what is dissipated",
    ),
    Quantity("lyapunov_change", "∫v'dt", "J", _TIME, "v' integrated together with the motion"),
    Quantity("energy", "-", "J", _BY_PART, "kinetic energy, and energy stored by each element"),
    Quantity("dissipation", "-", "W", _BY_PART, "power that each part dissipates"),
    Quantity(
        "supplied_power",
        "-",
        "W",
        _BY_PART,
        "power that each part supplies from outside",
        optional=True,
    ),
    Quantity(
        "supplied_energy",
        "-",
        "J",
        _TIME,
        "sum of supplied_power, integrated together with the motion",
        optional=True,
    ),
    Quantity(
        "energy_residual", "r", "J", _TIME, "v(t) - v(0) - ∫v'dt, zero but for integration errors"
    ),
    Quantity(
        "contact_work",
        "ε",
        "J",
        _TIME,
        "work of the contact force, ∫F'Λ dt (eq. 26)",
        optional=True,
    ),
    Quantity(
        "constraint_position_residual",
        "|E|",
        "m",
        _TIME,
        "how far the held point has drifted",
        optional=True,
    ),
    Quantity(
        "constraint_velocity_residual",
        "|F|",
        "m/s",
        _TIME,
        "how fast the held point drifts",
        optional=True,
    ),
    Quantity(
        "mode",
        "σ",
        "1",
        _VECTOR,
        "side of the surface, 0 where held on it or in a layer",
        optional=True,
    ),
    Quantity("switch_count", "-", "1", _VECTOR, "switches of each axis so far", optional=True),
    Quantity(
        "chatter_energy",
        "e",
        "J",
        _TIME,
        "½F'W⁻¹F + Σ K_s|E|, what the bouncing holds",
        optional=True,
    ),
    Quantity(
        "discarded_energy", "-", "J", _TIME, "energy that sticking took away so far", optional=True
    ),
    Quantity(
        "trusted_until",
        "-",
        "s",
        (),
        "how far the motion is reproducible in double precision",
        optional=True,
    ),
    Quantity(
        "switch_time", "-", "s", ("switch",), "time of each of the first switches", optional=True
    ),
    Quantity(
        "switch_axis", "-", "1", ("switch",), "axis of each of the first switches", optional=True
    ),
    Quantity(
        "transition_time",
        "-",
        "s",
        ("transition",),
        "time of each stick and release",
        optional=True,
    ),
    Quantity(
        "transition_axis",
        "-",
        "1",
        ("transition",),
        "axis of each stick and release",
        optional=True,
    ),
    Quantity("transition_kind", "-", "1", ("transition",), "stick or release", optional=True),
    Quantity("impact_count", "-", "1", _TIME, "impacts against the stop so far", optional=True),
    Quantity(
        "impact_loss",
        "-",
        "J",
        _TIME,
        "energy that impacts took away so far",
        optional=True,
    ),
    Quantity(
        "stop_contact",
        "-",
        "1",
        _TIME,
        "side of the stop against which the body rests, 0 where it does not",
        optional=True,
    ),
    Quantity("stop_angle", "θ_e", "rad", (), "largest |θ2|", optional=True),
    Quantity(
        "impact_time",
        "-",
        "s",
        ("impact",),
        "time of each of the first impacts",
        optional=True,
    ),
    Quantity(
        "impact_rate",
        "θ̇2",
        "rad/s",
        ("impact",),
        "rate of θ2 just before each of the first impacts",
        optional=True,
    ),
    Quantity(
        "rest_begin",
        "-",
        "s",
        ("rest",),
        "time at which each rest against the stop begins",
        optional=True,
    ),
    Quantity(
        "rest_end",
        "-",
        "s",
        ("rest",),
        "time at which each rest against the stop ends, NaN if it does not",
        optional=True,
    ),
    Quantity("energy_at_rest", "-h", "J", (), "stored energy of the rest state (eq. 28)"),
    Quantity("energy_round_off", "-", "J", (), "v below this energy is round-off"),
    Quantity(
        "rest_orientation",
        "Θ*",
        "rad",
        ("axis",),
        "Θ of the rest state at which v is zero",
    ),
    Quantity(
        "rest_position",
        "X*",
        "m",
        ("axis",),
        "X of the rest state at which v is zero, inertial",
    ),
    *(
        Quantity(name, "-", unit, shape, meaning, optional=True)
        for name, unit, shape, meaning in (
            ("peak_contact_displacement", "m", ("axis",), "E farthest from 0, by axis"),
            ("peak_contact_displacement_error", "m", ("axis",), _ERROR),
            ("peak_distance", "m", (), "the largest |E|"),
            ("peak_distance_error", "m", (), _ERROR),
            ("largest_pitch", "rad", (), "the largest |θ2|"),
            ("largest_pitch_error", "rad", (), _ERROR),
            ("settling_time", "s", (), "from here v < 1e-3 v(0); NaN: it did not settle"),
            ("settling_time_error", "s", (), "its error"),
        )
    ),
)


def run_dimensions(states: Iterable[OwnState]) -> dict[str, int]:
    """Return the lengths of the dimensions with a fixed length, of a run with some own states."""
    return {"axis": 3} | {state.dimension: state.size for state in states}


RUN_DIMENSIONS = run_dimensions(OWN_STATES.values())
"""The lengths of the dimensions with a fixed length."""

BY_NAME = {quantity.name: quantity for quantity in QUANTITIES}
"""The quantities by name, without the own states of named elements."""


def quantities_with(states: Iterable[OwnState]) -> dict[str, Quantity]:
    """Return all quantities by name, in the order of files, of a run with some own states."""
    found: dict[str, Quantity] = {}
    for name, quantity in BY_NAME.items():
        if name == "contact_displacement":
            found |= {state.name: state_quantity(state) for state in states}
        found[name] = quantity
    return found


def is_element_state(name: str) -> bool:
    """Return whether a name in a file is that of an own state of a named element.

    No other name at the top of a file has a dot.
    """
    return "." in name and "/" not in name
