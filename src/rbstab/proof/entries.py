"""What proofs state as plain data: it is made, stored and read in this form."""

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    NonNegativeInt,
    PositiveInt,
    SerializerFunctionWrapHandler,
    model_serializer,
)

NO_LENGTH = "a spring without length"
"""Where c* is attained, if not on a face of the range nor at a rest state."""


def _tuple(values: Any) -> Any:
    """Return an array, or a list of JSON, as a tuple; anything else as it is."""
    listed = values.tolist() if isinstance(values, np.ndarray) else values
    return tuple(listed) if isinstance(listed, list) else listed


Triple = Annotated[tuple[float, float, float], BeforeValidator(_tuple)]
"""Three numbers, also of an array."""

Quadruple = Annotated[tuple[float, float, float, float], BeforeValidator(_tuple)]

Numbers = Annotated[tuple[float, ...], BeforeValidator(_tuple)]

OF_ELEMENTS = ("brief", "closed", "degenerate", "every_start", "held", "on_rotations", "ridge")
"""Entries that a file has only where they say something."""


class Entry(BaseModel):
    """A part of a stored proof: it cannot be changed, and has no unknown entries."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    @model_serializer(mode="wrap")
    def _serialized(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out what only some elements have, so that all other files are as they were."""
        data: dict[str, Any] = handler(self)
        return {key: data[key] for key in data if key not in OF_ELEMENTS or data[key] is not None}


class ProvedState(Entry):
    """One rest state: Θ, X and D, and its potential energy, J.

    index is the number of independent directions in which the energy decreases. index_proved is
    whether it is proved.

    enclosure is a box of Θ, from low to high. If `proved`, it contains exactly this rest state.

    held is true if the force of an element of a user jumps there, and one between those on both
    sides balances the load, or if a repelling guard or a stop holds θ2 at its angle in this way.
    index then counts directions along the surface, or of θ1 and θ3. None: it is not held. ridge is
    true if the force pushes away from the surface: the energy falls on both sides, which is one
    direction more. degenerate is true if the Hessian is singular to round-off, and the index is not
    proved.
    """

    orientation: Triple
    position: Triple
    connector_state: Numbers
    energy: float
    index: NonNegativeInt
    proved: bool
    enclosure: tuple[Triple, Triple]
    index_proved: bool = False
    held: Literal[True] | None = None
    ridge: Literal[True] | None = None
    degenerate: Literal[True] | None = None

    @property
    def stable(self) -> bool | None:
        """Whether it is a minimum of the energy; None if its index is not determined."""
        return None if self.degenerate else self.index == 0


class ProvedRegion(Entry):
    """Motions with v < level converge to the lowest rest state; proved for v < lower_bound, J.

    energy is c*, J. It is attained at the orientation `attained_at`: on the named face of the
    range, at another rest state (face None), or where a spring has no length (`NO_LENGTH`).

    energy_bound is the same bound for the sum of all energies, J: each motion that at some time is
    in the range with less energy converges to the lowest rest state. None: not proved, or not
    stored (version 1).
    """

    energy: float
    level: float
    lower_bound: float
    attained_at: Triple
    face: str | None
    proved: bool
    energy_bound: float | None = None


class ProvedMinimum(Entry):
    """The region of one minimum: motions in it converge to this rest state, proved.

    A motion is in the region if at some time the sum of its energies is below `energy_bound`, J,
    and its Θ is in the component of {U < energy_bound} that contains the rest state.

    rest_state is its number, from 1 for the lowest. level is the height of its pass above it, J;
    lower_bound is proved. The pass is at the rest state with the number `pass_state`, or on the
    face `pass_face` of the range. If both are None it is not located: a box is undecided.
    pass_at is its Θ.
    """

    rest_state: PositiveInt
    level: float
    lower_bound: float
    energy_bound: float
    pass_state: PositiveInt | None
    pass_face: str | None
    pass_at: Triple | None
