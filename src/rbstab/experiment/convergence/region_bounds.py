"""The bounds of the regions of a proof, as values of v."""

import math

import numpy as np

from rbstab.analysis.approached_state import SAME_STATE
from rbstab.experiment.proof_record import Proof, Triple


def region_energies(proof: Proof) -> list[tuple[Triple, float]]:
    """Return the regions of a proof: the Θ of their rest states, and their bounds on the energy, J.

    The regions for all real θ1 and θ3 are included.
    """
    found = []
    for part in (proof, proof.unwrapped):
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


def level_of(proof: Proof, number: int, energy: float) -> float:
    """Return the level of the smallest region of a rest state that holds an energy, J.

    Args:
        proof: The proof.
        number: The number of the rest state, from 1 for the lowest.
        energy: The sum of all energies, J, of a motion that is in a region of this rest state.
    """
    rest = proof.states[number - 1]
    bounds = [
        bound
        for orientation, bound in region_energies(proof)
        if bound > energy and np.abs(np.subtract(orientation, rest.orientation)).max() < SAME_STATE
    ]
    return math.nextafter(min(bounds, default=energy) - rest.energy, -math.inf)
