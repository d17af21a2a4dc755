"""Rest states, boxes and faces of a proof as plain data."""

from typing import TYPE_CHECKING, Any

from rbstab.experiment.stored_proof.entries import Triple, triple
from rbstab.experiment.stored_proof.proof import ProvedState
from rbstab.mechanics.numbers import Array

if TYPE_CHECKING:
    from rbstab.proof.regions.landscape import Face
    from rbstab.proof.rest_points import RestPoint, RestStates
    from rbstab.proof.search import Box, Boxes


def search_entries(rest: "RestStates") -> dict[str, Any]:
    """Return the fields of `ProvedStates` that say how the search for rest states ended."""
    return {
        "outcome": rest.outcome.value,
        "proved": rest.proved,
        "unique": rest.unique,
        "examined": rest.examined,
        "undecided": _hulls(rest.zeros.undecided),
    }


def _hulls(undecided: "Boxes") -> tuple[tuple[Triple, Triple], ...]:
    from rbstab.proof.search import hulls

    merged = hulls(undecided)
    ends = zip(merged.lo.T.tolist(), merged.hi.T.tolist(), strict=True)
    return tuple((triple(low), triple(high)) for low, high in ends)


def state_of(point: "RestPoint") -> ProvedState:
    """Return a rest state as plain data."""
    rest, box = point.state, point.enclosure
    return ProvedState(
        orientation=triple(rest.motion.Theta),
        position=triple(rest.motion.X),
        connector_state=tuple(map(float, rest.own)),
        energy=rest.energy,
        index=point.index,
        proved=point.proved,
        enclosure=corners_of(box),
        index_proved=point.index_proved,
        held=point.state.on_kink or None,
        ridge=point.on_ridge or None,
        degenerate=point.degenerate or None,
    )


def face_name(face: "Face", end: Array) -> str:
    """Return the name of a face of the range |Θ| <= end, such as "θ2 = -π/2"."""
    from rbstab.proof.model import RANGE_END

    axis, sign = face
    name = "π/2" if axis == 1 else "π"
    if end[axis] != RANGE_END[axis]:
        name = f"{end[axis]:.4g}"
    return f"θ{axis + 1} = {'-' if sign < 0 else ''}{name}"


def corners_of(box: "Box") -> tuple[Triple, Triple]:
    """Return the lower and the upper corner of a box of three axes."""
    return triple(box.lo), triple(box.hi)
