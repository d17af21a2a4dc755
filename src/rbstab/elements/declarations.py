"""Declarations of the gains and own states of an element.

Config models, the JSON Schema, the units of sweep columns, names and sizes in result files, and
tables of the documentation follow from these declarations.
"""

from typing import Literal, NamedTuple

Shape = Literal["matrix", "diagonal", "number", "direction"]
"""A symmetric 3x3 matrix (a config may give its diagonal), three numbers, one number, or three
numbers that are not all zero, of which an element gets the unit vector."""


class Gain(NamedTuple):
    """A gain of an element.

    Attributes:
        name: The name in equations, configs and files, such as `K_t`.
        unit: The SI unit.
        description: The meaning and the frame, in words.
        shape: The shape of its value in a config.
        positive: Whether a matrix must be positive definite, or each number positive.
        dissipates: Whether the gain is a damping matrix. If so, the certificate checks its smallest
            eigenvalue.
        default: The value of each number of a gain that a config may leave out. It may be zero, not
            negative; a matrix may be positive semidefinite.
        below: A bound that a positive number must stay below.
        at_most: The largest value of a number that may be zero, and not negative.
        or_zero: Whether a positive number may be zero as well.
        key: Its key in the section of its element, if that is not its name: `actuators.lag`.
    """

    name: str
    unit: str
    description: str
    shape: Shape = "matrix"
    positive: bool = True
    dissipates: bool = False
    default: float | None = None
    below: float | None = None
    at_most: float | None = None
    or_zero: bool = False
    key: str = ""

    @property
    def place(self) -> str:
        """Its key in the section of its element: its name, unless it has another one."""
        return self.key or self.name


POINT = Gain("point", "m", "point of the body, body coordinates", "diagonal", positive=False)
ANCHOR = Gain("anchor", "m", "point of space, inertial", "diagonal", positive=False)
"""The two ends of an element that acts between a point of the body and a point of space."""


class OwnState(NamedTuple):
    """A vector of own states of an element.

    Attributes:
        name: The name in configs (`initial`) and files, such as `connector_state`. That of an
            element of the config is `state`; in files the name of the element stands before it
            (`second_tie.state`), and in its config `initial_` (`initial_state`).
        symbol: The symbol in equations, such as `D`.
        unit: The SI unit.
        description: The meaning, with frame and equation.
        size: The length of the vector. With length three it has the dimension `axis` in files,
            otherwise a dimension of its own.
    """

    name: str
    symbol: str
    unit: str
    description: str
    size: int = 3

    @property
    def dimension(self) -> str:
        """The dimension of its array in files."""
        return "axis" if self.size == 3 else f"{self.name}_component"

    @property
    def initial_key(self) -> str:
        """The key of its initial value in the config of an element."""
        return f"{INITIAL_PREFIX}{self.name}"

    def of_element(self, element: str) -> "OwnState":
        """Return the state with the name that it has in a system, for a named element."""
        return self._replace(name=f"{element}.{self.name}")


INITIAL_PREFIX = "initial_"
"""What the keys of initial values in the config of an element begin with; keys of gains do not."""


def is_initial(key: str) -> bool:
    """Return whether a key of the config of an element is that of an initial value."""
    return key.startswith(INITIAL_PREFIX)
