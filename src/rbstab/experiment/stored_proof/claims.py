"""What a stored proof claims, in the form that the checker reads."""

from typing import TYPE_CHECKING, Any

from rbstab.experiment.stored_proof.data import ProofData, ProvedStates

if TYPE_CHECKING:
    from rbstab.proof.record import Record


def record_of(proof: ProofData) -> "Record":
    """Return the energy of a proof, and its claims about each range.

    Args:
        proof: A proof with a reduced energy.
    """
    from rbstab.proof.record import FORMAT

    energy = proof.reduced_energy
    assert energy is not None
    pitch = energy.stop or "pi/2"
    ranges = [_claims(proof, proof.closed, ["pi", pitch, "pi"])]
    wide = proof.unwrapped
    if wide is not None and wide.end is not None:
        claims = _claims(wide, wide.every_start, [wide.end[0], pitch, wide.end[2]])
        ranges.append(claims | {"everywhere": True})
    return {"format": FORMAT, "energy": energy.model_dump(mode="json"), "ranges": ranges}


def _claims(proved: ProvedStates, every_start: bool | None, end: list[Any]) -> dict[str, Any]:
    """Return what is claimed about one range."""
    level = None if proved.region is None else proved.region.energy_bound
    found: dict[str, Any] = {
        "end": end,
        "complete": proved.proved,
        "states": [
            {
                "enclosure": [list(corner) for corner in state.enclosure],
                "index": state.index if state.index_proved else None,
                "held": bool(state.held),
                "ridge": bool(state.ridge),
            }
            for state in proved.states
            if state.proved
        ],
        "every_start": bool(every_start),
        # Below `level`, all of the range is the region of the lowest.
        "regions": [
            [one.rest_state - 1, one.energy_bound]
            for one in proved.regions
            if level is None or one.energy_bound > level
        ],
    }
    if proved.undecided:
        found["undecided"] = [[list(low), list(high)] for low, high in proved.undecided]
    return found if level is None else found | {"level": level}
