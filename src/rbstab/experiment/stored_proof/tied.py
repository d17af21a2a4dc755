"""Make the record of what was proved of a tied body in six variables."""

from typing import TYPE_CHECKING, Any

from rbstab.experiment.stored_proof.entries import triple
from rbstab.experiment.stored_proof.places import corners_of, face_name, search_entries, state_of
from rbstab.experiment.stored_proof.proof import (
    NO_LENGTH,
    Proof,
    ProvedRegion,
    ProvedState,
    UnwrappedStates,
)
from rbstab.experiment.stored_proof.written_energies import tied_energy_of

if TYPE_CHECKING:
    from rbstab.analysis.proof.tied.region import TiedRegion
    from rbstab.analysis.proof.tied.rest_states import TiedPoint, TiedRestStates


def tied_record(
    identity: str, rest: "TiedRestStates", unwrapped: "TiedRestStates | None", seconds: float
) -> Proof:
    """Return what was proved of a tied body in six variables as plain data.

    Args:
        identity: The id of the proof.
        rest: What was proved in the range of eq. 5.
        unwrapped: The same for all real θ1 and θ3, or None.
        seconds: The time that it took.
    """
    guard = rest.energy.form.guard
    closed = guard is not None and guard.outer is not None and rest.every_start
    wide, every_start = None, closed or (unwrapped is not None and unwrapped.every_start)
    if unwrapped is not None:
        wide = UnwrappedStates(
            every_start=every_start or None,
            **_tied_entries(unwrapped, every_start=every_start),
        )
    return Proof(
        id=identity,
        seconds=seconds,
        tied_energy=tied_energy_of(rest.energy),
        unwrapped=wide,
        closed=closed or None,
        **_tied_entries(rest, every_start=every_start),
    )


def _tied_entries(rest: "TiedRestStates", *, every_start: bool) -> dict[str, Any]:
    """Return the fields of `ProvedStates`; where every start converges, no region is needed."""
    region = None if every_start else rest.region
    return {
        **search_entries(rest),
        "states": tuple(_tied_state(one) for one in rest.states),
        "end": triple(rest.end),
        "region": None if region is None else _tied_region(region, rest),
    }


def _tied_state(one: "TiedPoint") -> ProvedState:
    return state_of(one.point).model_copy(update={"shift": corners_of(one.shift)})


def _tied_region(region: "TiedRegion", rest: "TiedRestStates") -> ProvedRegion:
    face = None if region.face is None else face_name(region.face.value, rest.end)
    lowest = rest.states[0].point.state.energy
    return ProvedRegion(
        energy=region.energy,
        level=region.energy - lowest,
        lower_bound=region.lower_bound,
        attained_at=triple(region.attained_at),
        face=face if region.line is None else NO_LENGTH,
        proved=rest.proved and region.energy_bound is not None,
        energy_bound=region.energy_bound,
    )
