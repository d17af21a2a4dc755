"""The quantities of a run: their names in files, symbols, units and formulas.

Each is one row. What runs record, what traces keep, what is compiled for batches, the columns of
sweeps and the table in `results/README.md` follow from it.
"""

from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np

from rbstab.elements.declarations import OwnState
from rbstab.elements.registry import NAMED_ELEMENTS, OWN_STATES
from rbstab.elements.rotational_stabilizer import RotationalStabilizer
from rbstab.elements.translational_stabilizer import TranslationalStabilizer
from rbstab.mechanics.algebra import ZERO
from rbstab.mechanics.numbers import Array, Number, sqrt
from rbstab.systems.system import Observation, System

Formula = Callable[[Observation], Array | Number]
"""A formula in plain numpy notation. It takes any kind of number, such as heyoka's expressions."""


class Peak(NamedTuple):
    """A quantity whose largest values are columns of sweeps, as `peak_NAME`.

    Attributes:
        rate: The formula of its derivative.
        meaning: The meaning of the column.
        signed: Whether the value farthest from zero has its sign.
    """

    rate: Formula
    meaning: str
    signed: bool = True


class Quantity(NamedTuple):
    """A quantity of a run.

    Attributes:
        name: The name in result files.
        symbol: The symbol in the paper.
        unit: The SI unit; "1" for dimensionless quantities.
        dimensions: The dimensions of its array.
        meaning: The meaning, with frame and equation.
        formula: Its value at a state, without the dimension `time`. A quantity without one is
            no function of the state: it is recorded with the motion.
        only_for: Returns whether a system has the quantity; None: all have it.
        trace: Whether the traces of sweeps have it.
        end: What the column of its value at the end, `final_NAME`, says behind its symbol; None:
            there is no such column.
        peak: The column of its largest values, if there is one.
    """

    name: str
    symbol: str
    unit: str
    dimensions: tuple[str, ...]
    meaning: str
    formula: Formula | None = None
    only_for: Callable[[System], bool] | None = None
    trace: bool = False
    end: str | None = None
    peak: Peak | None = None

    def exists_in(self, system: System) -> bool:
        """Whether a system may have the quantity."""
        return self.only_for is None or self.only_for(system)

    @property
    def long_name(self) -> str:
        """What files say of it."""
        return f"{self.symbol}: {self.meaning}"


def named_elements(system: System) -> tuple[str, ...]:
    """Return the names of the elements that the config names, in their order."""
    return tuple(
        element.name
        for element in system.elements
        if isinstance(element, NAMED_ELEMENTS) or element.from_user
    )


def state_quantity(state: OwnState) -> Quantity:
    """Return the quantity of an own state of an element."""
    return Quantity(
        state.name,
        state.symbol,
        state.unit,
        ("time", state.dimension),
        state.description,
        formula=lambda seen: seen.own_state(state.name),
        only_for=lambda system: state.name in system.own_states,
        trace=True,
        end="; NaN: it has none",
    )


def _of_elements(part: str) -> Formula:
    """Return the formula of a part of the wrench of each named element, shape (elements, 3)."""

    def formula(seen: Observation) -> Array:
        names = named_elements(seen.system)
        pairs = zip(seen.system.elements, seen.wrenches, strict=True)
        return np.array(
            [getattr(wrench, part) for element, wrench in pairs if element.name in names]
        )

    return formula


def _of_stabilizer(kind: type, part: str) -> Formula:
    """Return the formula of a part of the wrench of a stabilizer, shape (3,)."""

    def formula(seen: Observation) -> Array:
        pairs = zip(seen.system.elements, seen.wrenches, strict=True)
        vectors = [getattr(wrench, part) for element, wrench in pairs if isinstance(element, kind)]
        return vectors[0] if vectors else ZERO

    return formula


def total_energy(energies: Iterable[Number]) -> Number:
    """Return the sum of energies by part, J: v and the energy at rest.

    Eq. 28 to 31, 34, 42 and 45 are this sum, each for one set of elements.
    """
    return sum(energies)


def _lyapunov_rate(seen: Observation) -> Number:
    """Return v' (eq. 29, 37, 43 and 46)."""
    rate = -sum(seen.dissipation.tolist()[1:])
    return sum(seen.supplied.tolist()[1:]) + rate if seen.system.supplies else rate


def _has_named_elements(system: System) -> bool:
    return bool(named_elements(system))


def _drifts(system: System) -> bool:
    """Whether the held point of a system drifts, as its motion is not confined to E = 0."""
    return system.coordinates.name == "manifold"


_TIME = ("time",)
_VECTOR = ("time", "axis")
_BY_PART = ("time", "part")
_BY_ELEMENT = ("time", "element", "axis")
_ERROR = "bound of its error; NaN: unknown, and it is that of the samples"

# fmt: off
QUANTITIES: tuple[Quantity, ...] = (
    Quantity("time", "t", "s", _TIME, "time from the start"),
    Quantity("orientation", "Θ", "rad", _VECTOR, "Euler angles, A = A1(θ1) A2(θ2) A3(θ3) (eq. 2)",
             formula=lambda seen: seen.motion.Theta, trace=True, end="",
             peak=Peak(lambda seen: seen.motion.B @ seen.motion.Omega,
                       "the largest |Θ|, by axis", signed=False)),
    Quantity("angular_velocity", "Ω", "rad/s", _VECTOR, "angular velocity, body (eq. 1)",
             formula=lambda seen: seen.motion.Omega, trace=True, end=", body"),
    Quantity("position", "X", "m", _VECTOR, "centre of gravity, inertial (eq. 1)",
             formula=lambda seen: seen.motion.X, trace=True, end=", inertial"),
    Quantity("velocity", "V", "m/s", _VECTOR, "velocity of the centre of gravity, inertial (eq. 1)",
             formula=lambda seen: seen.motion.V, trace=True, end=", inertial"),
    *map(state_quantity, OWN_STATES.values()),
    Quantity("contact_displacement", "E", "m", _VECTOR,
             "contact point from its anchor, inertial (eq. 4, 38)",
             formula=lambda seen: seen.motion.E, trace=True,
             peak=Peak(lambda seen: seen.motion.F, "E farthest from 0, by axis")),
    Quantity("contact_velocity", "F", "m/s", _VECTOR, "dE/dt, inertial (eq. 4)",
             formula=lambda seen: seen.motion.F, trace=True),
    Quantity("contact_force", "Λ", "N", _VECTOR,
             "force on the body at the contact point, inertial (eq. 15, 20, 22, 40)",
             formula=lambda seen: seen.contact_force, trace=True),
    Quantity("stabilizing_force", "H", "N", _VECTOR,
             "force of the translational stabilizer (eq. 24)",
             formula=_of_stabilizer(TranslationalStabilizer, "force")),
    Quantity("stabilizing_couple", "N", "N m", _VECTOR,
             "couple of the rotational stabilizer, body (eq. 23)",
             formula=_of_stabilizer(RotationalStabilizer, "couple")),
    Quantity("element_force", "-", "N", _BY_ELEMENT,
             "force of each element of the config, inertial",
             formula=_of_elements("force"), only_for=_has_named_elements),
    Quantity("element_couple", "-", "N m", _BY_ELEMENT,
             "couple of each element of the config about the centre of gravity, body",
             formula=_of_elements("couple"), only_for=_has_named_elements),
    Quantity("lyapunov", "v", "J", _TIME, "Lyapunov function, sum of energy less energy_at_rest",
             trace=True),
    Quantity("lyapunov_rate", "v'", "W", _TIME,
             "derivative of v, what is supplied minus what is dissipated",
             formula=_lyapunov_rate, trace=True),
    Quantity("lyapunov_change", "∫v'dt", "J", _TIME, "v' integrated together with the motion",
             trace=True),
    Quantity("energy", "-", "J", _BY_PART, "kinetic energy, and energy stored by each element",
             formula=lambda seen: seen.energy),
    Quantity("dissipation", "-", "W", _BY_PART, "power that each part dissipates",
             formula=lambda seen: seen.dissipation),
    Quantity("supplied_power", "-", "W", _BY_PART, "power that each part supplies from outside",
             formula=lambda seen: seen.supplied,
             only_for=lambda system: system.supplies),
    Quantity("energy_residual", "r", "J", _TIME,
             "v(t) - v(0) - ∫v'dt, zero but for integration errors", trace=True),
    Quantity("supplied_energy", "-", "J", _TIME,
             "sum of supplied_power, integrated together with the motion",
             only_for=lambda system: system.supplies, trace=True),
    Quantity("contact_work", "ε", "J", _TIME, "work of the contact force, ∫F'Λ dt (eq. 26)"),
    Quantity("constraint_position_residual", "|E|", "m", _TIME,
             "how far the held point has drifted",
             formula=lambda seen: sqrt(seen.motion.E @ seen.motion.E), only_for=_drifts),
    Quantity("constraint_velocity_residual", "|F|", "m/s", _TIME,
             "how fast the held point drifts",
             formula=lambda seen: sqrt(seen.motion.F @ seen.motion.F), only_for=_drifts),
    Quantity("mode", "σ", "1", _VECTOR, "side of the surface, 0 where held on it or in a layer"),
    Quantity("switch_count", "-", "1", _VECTOR, "switches of each axis so far"),
    Quantity("chatter_energy", "e", "J", _TIME, "½F'W⁻¹F + Σ K_s|E|, what the bouncing holds"),
    Quantity("discarded_energy", "-", "J", _TIME, "energy that sticking took away so far"),
    Quantity("trusted_until", "-", "s", (),
             "how far the motion is reproducible in double precision"),
    Quantity("switch_time", "-", "s", ("switch",), "time of each of the first switches"),
    Quantity("switch_axis", "-", "1", ("switch",), "axis of each of the first switches"),
    Quantity("transition_time", "-", "s", ("transition",), "time of each stick and release"),
    Quantity("transition_axis", "-", "1", ("transition",), "axis of each stick and release"),
    Quantity("transition_kind", "-", "1", ("transition",), "stick or release"),
    Quantity("impact_count", "-", "1", _TIME, "impacts against the stop so far"),
    Quantity("impact_loss", "-", "J", _TIME, "energy that impacts took away so far"),
    Quantity("stop_contact", "-", "1", _TIME,
             "side of the stop against which the body rests, 0 where it does not"),
    Quantity("stop_angle", "θ_e", "rad", (), "largest |θ2|"),
    Quantity("impact_time", "-", "s", ("impact",), "time of each of the first impacts"),
    Quantity("impact_rate", "θ̇2", "rad/s", ("impact",),
             "rate of θ2 just before each of the first impacts"),
    Quantity("rest_begin", "-", "s", ("rest",),
             "time at which each rest against the stop begins"),
    Quantity("rest_end", "-", "s", ("rest",),
             "time at which each rest against the stop ends, NaN if it does not"),
    Quantity("energy_at_rest", "-h", "J", (), "stored energy of the rest state (eq. 28)"),
    Quantity("energy_round_off", "-", "J", (), "v below this energy is round-off"),
    Quantity("rest_orientation", "Θ*", "rad", ("axis",),
             "Θ of the rest state at which v is zero"),
    Quantity("rest_position", "X*", "m", ("axis",),
             "X of the rest state at which v is zero, inertial"),
    Quantity("peak_contact_displacement", "-", "m", ("axis",), "E farthest from 0, by axis"),
    Quantity("peak_contact_displacement_error", "-", "m", ("axis",), _ERROR),
    Quantity("peak_distance", "-", "m", (), "the largest |E|"),
    Quantity("peak_distance_error", "-", "m", (), _ERROR),
    Quantity("largest_pitch", "-", "rad", (), "the largest |θ2|"),
    Quantity("largest_pitch_error", "-", "rad", (), _ERROR),
    Quantity("settling_time", "-", "s", (), "from here v < 1e-3 v(0); NaN: it did not settle"),
    Quantity("settling_time_error", "-", "s", (), "its error"),
)
# fmt: on


def run_dimensions(states: Iterable[OwnState]) -> dict[str, int]:
    """Return the lengths of the dimensions with a fixed length, of a run with some own states."""
    return {"axis": 3} | {state.dimension: state.size for state in states}


RUN_DIMENSIONS = run_dimensions(OWN_STATES.values())
"""The lengths of the dimensions with a fixed length."""

BY_NAME = {quantity.name: quantity for quantity in QUANTITIES}
"""The quantities by name, without the own states of named elements."""

PEAKS = {quantity.name: quantity.peak for quantity in QUANTITIES if quantity.peak}
"""The quantities with peaks. Each is a vector along `axis`."""


def quantities_with(states: Iterable[OwnState]) -> dict[str, Quantity]:
    """Return all quantities by name, in the order of files, of a run with some own states."""
    quantities: dict[str, Quantity] = {}
    for name, quantity in BY_NAME.items():
        if name == "contact_displacement":
            quantities |= {state.name: state_quantity(state) for state in states}
        quantities[name] = quantity
    return quantities


def observed_in(system: System) -> dict[str, Quantity]:
    """Return the quantities that follow from the states of a system by their formulas."""
    named = quantities_with(system.declared_states)
    return {
        name: quantity
        for name, quantity in named.items()
        if quantity.formula and quantity.exists_in(system)
    }


def values_of(quantities: Iterable[Quantity], seen: Observation) -> list[Number]:
    """Return the values of quantities at a state, one after the other."""
    return [
        number
        for quantity in quantities
        if quantity.formula is not None
        for number in np.ravel(np.asarray(quantity.formula(seen))).tolist()
    ]


def is_element_state(name: str) -> bool:
    """Return whether a name in a file is that of an own state of a named element.

    No other name at the top of a file has a dot.
    """
    return "." in name and "/" not in name
