"""Make the record of what was proved by an energy of Θ alone, or looked for."""

from typing import TYPE_CHECKING, Any, NamedTuple

from rbstab.experiment.stored_proof.energies import ProvedEnergy
from rbstab.experiment.stored_proof.entries import triple
from rbstab.experiment.stored_proof.places import face_name, search_entries, state_of
from rbstab.experiment.stored_proof.proof import (
    NO_LENGTH,
    Proof,
    ProvedMinimum,
    ProvedRegion,
    UnwrappedStates,
    no_proof,
)
from rbstab.mechanics.numbers import Array

if TYPE_CHECKING:
    from rbstab.analysis.descents.searched import SearchedState
    from rbstab.proof.model import Energy
    from rbstab.proof.regions.regions import Certified, Region, Regions
    from rbstab.proof.rest_points import RestStates


def searched_record(
    identity: str, states: "list[SearchedState]", seconds: float, outcome: str | None = None
) -> Proof:
    """Return the record of rest states that were looked for, where no energy of Θ alone exists.

    Args:
        identity: The id.
        states: The rest states.
        seconds: The time that it took.
        outcome: Why nothing is proved of them; by default, that nothing was to be proved.
    """
    from rbstab.proof.rest_points import RestPoint, SearchOutcome
    from rbstab.proof.search import Box

    points = [
        RestPoint(
            one.state,
            one.index,
            Box(one.state.motion.Theta, one.state.motion.Theta),
            proved=False,
            index_proved=False,
        )
        for one in states
    ]
    nothing = no_proof(identity, outcome or SearchOutcome.SEARCHED.value, seconds)
    return nothing.model_copy(update={"states": tuple(state_of(point) for point in points)})


class Found(NamedTuple):
    """What was proved in one range of Θ: its rest states, and the regions of the minima."""

    rest: "RestStates"
    regions: "Regions"


def proof_record(
    identity: str, energy: "Energy", found: Found, unwrapped: Found | None, seconds: float
) -> Proof:
    """Return what was proved as plain data.

    Args:
        identity: The id of the proof.
        energy: The energy.
        found: What was proved in the range of eq. 5.
        unwrapped: The same for all real θ1 and θ3, or None.
        seconds: The time that it took.
    """
    from rbstab.proof.record import energy_record

    wide = None
    if unwrapped is not None:
        every_start = unwrapped.rest.every_start or None
        wide = UnwrappedStates(every_start=every_start, **_entries(unwrapped))
    return Proof(
        id=identity,
        seconds=seconds,
        reduced_energy=ProvedEnergy.model_validate(energy_record(energy)),
        unwrapped=wide,
        closed=found.rest.every_start_of_range or None,
        **_entries(found),
    )


def _entries(found: Found) -> dict[str, Any]:
    """Return the fields of `ProvedStates`."""
    rest, certified = found.rest, found.regions.certified
    return {
        **search_entries(rest),
        "states": tuple(state_of(point) for point in rest.states),
        "region": None if certified is None else _region(certified, rest),
        "regions": tuple(_minimum(one, rest.end) for one in found.regions.minima),
        "end": triple(rest.end),
    }


def _region(region: "Certified", rest: "RestStates") -> ProvedRegion:
    return ProvedRegion(
        energy=region.energy,
        level=region.level,
        lower_bound=region.lower_bound,
        attained_at=triple(region.attained_at),
        face=_face(region, rest.end),
        proved=rest.proved and region.closed,
        energy_bound=region.energy_bound,
    )


def _face(region: "Certified", end: Array) -> str | None:
    if region.spring:
        return NO_LENGTH
    return None if region.face is None else face_name(region.face, end)


def _minimum(region: "Region", end: Array) -> ProvedMinimum:
    return ProvedMinimum(
        rest_state=region.state + 1,
        level=region.level,
        lower_bound=region.lower_bound,
        energy_bound=region.energy_bound,
        pass_state=None if region.pass_state is None else region.pass_state + 1,
        pass_face=None if region.pass_face is None else face_name(region.pass_face, end),
        pass_at=None if region.pass_at is None else triple(region.pass_at),
    )
