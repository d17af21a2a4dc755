"""Make the record of what was proved by an energy of Θ alone, or looked for."""

from typing import TYPE_CHECKING, Any, NamedTuple

from rbstab.experiment.stored_proof.data import UnwrappedStates
from rbstab.experiment.stored_proof.proof import Proof, no_proof

if TYPE_CHECKING:
    from rbstab.analysis.descents.searched import SearchedState
    from rbstab.proof.model import Energy
    from rbstab.proof.regions.regions import Regions
    from rbstab.proof.rest_points import RestStates


def searched_record(identity: str, states: "list[SearchedState]", outcome: str) -> Proof:
    """Return the record of rest states that were looked for, where no energy of Θ alone exists.

    Args:
        identity: The id.
        states: The rest states.
        outcome: Why nothing is proved of them.
    """
    from rbstab.proof.rest_points import state_entry

    entries = tuple(state_entry(searched.state, searched.index) for searched in states)
    return no_proof(identity, outcome).model_copy(update={"states": entries})


class RangeProof(NamedTuple):
    """What was proved in one range of Θ: its rest states, and the regions of the minima."""

    rest: "RestStates"
    regions: "Regions"


def proof_record(
    identity: str, energy: "Energy", in_range: RangeProof, unwrapped: RangeProof | None
) -> Proof:
    """Return what was proved as plain data.

    Args:
        identity: The id of the proof.
        energy: The energy.
        in_range: What was proved in the range of eq. 5.
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
            "closed": in_range.rest.every_start_of_range or None,
            **_entries(in_range),
        }
    )


def _entries(range_proof: RangeProof) -> dict[str, Any]:
    """Return the fields of `ProvedStates`."""
    from rbstab.proof.boxes import hulls

    rest = range_proof.rest
    undecided = hulls(rest.zeros.undecided)
    return {
        "outcome": rest.outcome.value,
        "proved": rest.proved,
        "unique": rest.unique,
        "examined": rest.examined,
        "undecided": list(zip(undecided.lo.T, undecided.hi.T, strict=True)),
        "states": rest.states,
        "region": range_proof.regions.certified,
        "regions": range_proof.regions.minima,
        "end": rest.end,
    }
