"""The quantities of a run: their names in files, symbols, units, and the equations behind them."""

from typing import NamedTuple


class Quantity(NamedTuple):
    """One quantity along a run.

    name is what the result file calls it, symbol the paper's; unit is SI ("1" where there is
    none); dimensions are the axes of its array; meaning says what it is, in which frame, by which
    equation.
    """

    name: str
    symbol: str
    unit: str
    dimensions: tuple[str, ...]
    meaning: str


_ALONG = ("time",)
_VECTOR = ("time", "axis")
_BY_PART = ("time", "part")

QUANTITIES = (
    Quantity("time", "t", "s", _ALONG, "time from the start"),
    Quantity("orientation", "Θ", "rad", _VECTOR, "Euler angles, A = A1(θ1) A2(θ2) A3(θ3) (eq. 2)"),
    Quantity("angular_velocity", "Ω", "rad/s", _VECTOR, "angular velocity, body (eq. 1)"),
    Quantity("position", "X", "m", _VECTOR, "centre of gravity, inertial (eq. 1)"),
    Quantity(
        "velocity", "V", "m/s", _VECTOR, "velocity of the centre of gravity, inertial (eq. 1)"
    ),
    Quantity("connector_state", "D", "m", _VECTOR, "own state of the connector, inertial (eq. 22)"),
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
    Quantity("lyapunov", "v", "J", _ALONG, "Lyapunov function, sum of energy less energy_at_rest"),
    Quantity("lyapunov_rate", "v'", "W", _ALONG, "derivative of v, minus the sum of dissipation"),
    Quantity("lyapunov_change", "∫v'dt", "J", _ALONG, "v' integrated together with the motion"),
    Quantity("energy", "-", "J", _BY_PART, "kinetic energy, and energy stored by each element"),
    Quantity("dissipation", "-", "W", _BY_PART, "power that each part dissipates"),
    Quantity(
        "energy_residual", "r", "J", _ALONG, "v(t) - v(0) - ∫v'dt, zero but for integration errors"
    ),
    Quantity("contact_work", "ε", "J", _ALONG, "work of the contact force, ∫F'Λ dt (eq. 26)"),
    Quantity(
        "constraint_position_residual", "|E|", "m", _ALONG, "how far the held point has drifted"
    ),
    Quantity(
        "constraint_velocity_residual", "|F|", "m/s", _ALONG, "how fast the held point drifts"
    ),
    Quantity("mode", "σ", "1", _VECTOR, "side of the surface, 0 where held on it or in a layer"),
    Quantity("switch_count", "-", "1", _VECTOR, "switches of each axis so far"),
    Quantity("chatter_energy", "e", "J", _ALONG, "½F'W⁻¹F + Σ K_s|E|, what the bouncing holds"),
    Quantity("discarded_energy", "-", "J", _ALONG, "energy that sticking took away so far"),
    Quantity(
        "trusted_until", "-", "s", (), "how far the motion is reproducible in double precision"
    ),
    Quantity("switch_time", "-", "s", ("switch",), "time of each of the first switches"),
    Quantity("switch_axis", "-", "1", ("switch",), "axis of each of the first switches"),
    Quantity("transition_time", "-", "s", ("transition",), "time of each stick and release"),
    Quantity("transition_axis", "-", "1", ("transition",), "axis of each stick and release"),
    Quantity("transition_kind", "-", "1", ("transition",), "stick or release"),
    Quantity("energy_at_rest", "-h", "J", (), "stored energy of the rest state (eq. 28)"),
)

BY_NAME = {quantity.name: quantity for quantity in QUANTITIES}
