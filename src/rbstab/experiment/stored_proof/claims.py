"""What a stored proof claims, in the form that the checker reads."""

from typing import TYPE_CHECKING, Any

from rbstab.experiment.stored_proof.proof import Proof, ProvedState, ProvedStates

if TYPE_CHECKING:
    from rbstab.proof.record import Record


def record_of(proof: Proof) -> "Record":
    """Return the energy of a proof, and its claims about each range.

    Args:
        proof: A proof with a reduced energy.
    """
    from rbstab.proof.record import FORMAT

    energy = proof.reduced_energy
    assert energy is not None
    pitch = energy.stop or "pi/2"
    ranges = [_claims(proof, every_start=bool(proof.closed)) | {"end": ["pi", pitch, "pi"]}]
    wide = proof.unwrapped
    if wide is not None and wide.end is not None:
        first, _, third = wide.end
        claims = _claims(wide, every_start=bool(wide.every_start))
        ranges.append(claims | {"end": [first, pitch, third], "everywhere": True})
    return {"format": FORMAT, "energy": energy.model_dump(mode="json"), "ranges": ranges}


def _claims(proved: ProvedStates, *, every_start: bool) -> dict[str, Any]:
    """Return what is claimed about one range, but for its ends."""
    found: dict[str, Any] = {
        "complete": proved.proved,
        "states": [_state(state) for state in proved.states if state.proved],
        "every_start": every_start,
    }
    if proved.undecided:
        found["undecided"] = [[list(low), list(high)] for low, high in proved.undecided]
    level = None if proved.region is None else proved.region.energy_bound
    if level is not None:
        found["level"] = level
    # Below `level`, all of the range is the region of the lowest.
    higher = (one for one in proved.regions if level is None or one.energy_bound > level)
    found["regions"] = [[one.rest_state - 1, one.energy_bound] for one in higher]
    return found


def _state(state: ProvedState) -> dict[str, Any]:
    return {
        "enclosure": [list(corner) for corner in state.enclosure],
        "index": state.index if state.index_proved else None,
        "held": bool(state.held),
        "ridge": bool(state.ridge),
    }
