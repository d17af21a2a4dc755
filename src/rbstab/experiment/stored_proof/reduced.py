"""Make the record of what was proved by an energy of Θ alone, or looked for."""

from typing import TYPE_CHECKING, Any, NamedTuple

from rbstab.experiment.stored_proof.data import (
    NO_LENGTH,
    ProvedMinimum,
    ProvedRegion,
    ProvedState,
    UnwrappedStates,
)
from rbstab.experiment.stored_proof.entries import Entry
from rbstab.experiment.stored_proof.proof import Proof, no_proof
from rbstab.mechanics.numbers import Array

if TYPE_CHECKING:
    from rbstab.analysis.descents.searched import SearchedState
    from rbstab.proof.model import Energy
    from rbstab.proof.regions.landscape import Face
    from rbstab.proof.regions.regions import Certified, Region, Regions
    from rbstab.proof.rest_points import RestPoint, RestStates


def searched_record(identity: str, states: "list[SearchedState]", outcome: str) -> Proof:
    """Return the record of rest states that were looked for, where no energy of Θ alone exists.

    Args:
        identity: The id.
        states: The rest states.
        outcome: Why nothing is proved of them.
    """
    from rbstab.proof.boxes import Box
    from rbstab.proof.rest_points import RestPoint

    points = [
        RestPoint(one.state, one.index, Box(*[one.state.motion.Theta] * 2), False, False)
        for one in states
    ]
    return no_proof(identity, outcome).model_copy(update={"states": tuple(map(_state, points))})


class Found(NamedTuple):
    """What was proved in one range of Θ: its rest states, and the regions of the minima."""

    rest: "RestStates"
    regions: "Regions"


def proof_record(identity: str, energy: "Energy", found: Found, unwrapped: Found | None) -> Proof:
    """Return what was proved as plain data.

    Args:
        identity: The id of the proof.
        energy: The energy.
        found: What was proved in the range of eq. 5.
        unwrapped: The same for all real θ1 and θ3, or None.
    """
    from rbstab.proof.record import energy_record

    wide = None
    if unwrapped is not None:
        every_start = unwrapped.rest.every_start or None
        wide = UnwrappedStates(every_start=every_start, **_entries(unwrapped))
    return Proof.model_validate(
        {
            "id": identity,
            "reduced_energy": energy_record(energy),
            "unwrapped": wide,
            "closed": found.rest.every_start_of_range or None,
            **_entries(found),
        }
    )


def _entries(found: Found) -> dict[str, Any]:
    """Return the fields of `ProvedStates`."""
    from rbstab.proof.boxes import hulls

    rest, certified = found.rest, found.regions.certified
    undecided = hulls(rest.zeros.undecided)
    return {
        "outcome": rest.outcome.value,
        "proved": rest.proved,
        "unique": rest.unique,
        "examined": rest.examined,
        "undecided": list(zip(undecided.lo.T, undecided.hi.T, strict=True)),
        "states": [_state(point) for point in rest.states],
        "region": None if certified is None else _region(certified, rest),
        "regions": [_minimum(one, rest.end) for one in found.regions.minima],
        "end": rest.end,
    }


def _state(point: "RestPoint") -> ProvedState:
    rest, box = point.state, point.enclosure
    entries = {
        "orientation": rest.motion.Theta,
        "position": rest.motion.X,
        "connector_state": rest.own,
        "energy": rest.energy,
        "index": point.index,
        "proved": point.proved,
        "enclosure": (box.lo, box.hi),
        "index_proved": point.index_proved,
        "held": rest.on_kink or None,
        "ridge": point.on_ridge or None,
        "degenerate": point.degenerate or None,
    }
    return ProvedState.model_validate(entries)


def _region(region: "Certified", rest: "RestStates") -> dict[str, Any]:
    """Return the entries of a `ProvedRegion`."""
    face = NO_LENGTH if region.spring else _face(region.face, rest.end)
    proved = rest.proved and region.closed
    return _same(region, ProvedRegion) | {"face": face, "proved": proved}


def _minimum(region: "Region", end: Array) -> dict[str, Any]:
    """Return the entries of a `ProvedMinimum`, which counts from 1."""
    passed = None if region.pass_state is None else region.pass_state + 1
    face = {"pass_face": _face(region.pass_face, end), "pass_state": passed}
    return _same(region, ProvedMinimum) | face | {"rest_state": region.state + 1}


def _same(region: object, model: type[Entry]) -> dict[str, Any]:
    """Return the fields of a region that an entry of a proof has too."""
    return {name: value for name, value in vars(region).items() if name in model.model_fields}


def _face(face: "Face | None", end: Array) -> str | None:
    """Return the name of a face of the range |Θ| <= end, such as "θ2 = -π/2"; None of none."""
    from rbstab.proof.model import RANGE_END

    if face is None:
        return None
    axis, sign = face
    name = "π/2" if axis == 1 else "π"
    if end[axis] != RANGE_END[axis]:
        name = f"{end[axis]:.4g}"
    return f"θ{axis + 1} = {'-' if sign < 0 else ''}{name}"
