"""The bounds of the regions of a proof, as values of v."""

import math

import numpy as np

from rbstab.analysis.approached_state import SAME_STATE
from rbstab.experiment.stored_proof.entries import Triple
from rbstab.experiment.stored_proof.proof import Proof


def region_energies(proof: Proof, *, in_range: bool = True) -> list[tuple[Triple, float]]:
    """Return the regions of a proof: the Θ of their rest states, and their bounds on the energy, J.

    Args:
        proof: The proof.
        in_range: Whether to include the regions in the range of eq. 5; those for all real θ1 and θ3
            come after them. Where every start converges, the bound is infinite.
    """
    found = list[tuple[Triple, float]]()
    if proof.every_start:
        all_of = proof if proof.unwrapped is None else proof.unwrapped
        found.append((all_of.states[0].orientation, math.inf))
    for part in (proof if in_range else None, proof.unwrapped):
        if part is None:
            continue
        if part.region is not None and part.region.lower_bound > 0:
            lowest = part.states[0]
            bound = part.region.energy_bound
            absolute = lowest.energy + part.region.lower_bound if bound is None else bound
            found.append((lowest.orientation, absolute))
        found += [
            (part.states[region.rest_state - 1].orientation, region.energy_bound)
            for region in part.regions
        ]
    return found


def level_of(proof: Proof, number: int, energy: float, *, in_range: bool = True) -> float:
    """Return the level of the region of a rest state in which a motion is, as a value of v, J.

    Args:
        proof: The proof.
        number: The number of the rest state, from 1 for the lowest.
        energy: The sum of all energies, J, of a motion that is in a region of this rest state.
        in_range: Whether its Θ is in the range of eq. 5.
    """
    rest = proof.states[number - 1]
    bounds = [
        bound
        for orientation, bound in region_energies(proof, in_range=in_range)
        if np.abs(np.subtract(orientation, rest.orientation)).max() < SAME_STATE
    ]
    # An energy in doubles can be above its bound by round-off, although the exact one is below.
    bound = next((bound for bound in bounds if bound > energy), max(bounds, default=energy))
    return bound if bound == math.inf else math.nextafter(bound - rest.energy, -math.inf)
