"""Bodies with ligaments, and their energies by formulas of their own."""

from itertools import pairwise

import numpy as np
from scipy.integrate import quad

from rbstab.elements.ligament import Ligament
from support.held_springs import DAMPING, WEIGHT, R

__all__ = ["DAMPING", "WEIGHT", "R"]


def ligament_of(  # noqa: PLR0917 (its numbers, in the order of a config)
    point=(0.1, 0.2, 0.3),
    anchor=(0.5, 0.1, 0.5),
    stiffness=400.0,
    slack_length=0.3,
    toe_strain=0.05,
    name="ligament",
):
    """Return a ligament; by default it is taut at Θ = 0."""
    ends = {"point": np.array(point), "anchor": np.array(anchor)}
    law = {"stiffness": stiffness, "slack_length": slack_length, "toe_strain": toe_strain}
    return Ligament(name=name, damping=5.0, **ends, **law)


def tension(ligament, length):
    """Return T (Blankevoort and Huiskes)."""
    strain = length / ligament.slack_length - 1
    if strain <= 0:
        return 0.0
    if strain <= 2 * ligament.toe_strain:
        return ligament.stiffness * strain**2 / (4 * ligament.toe_strain)
    return ligament.stiffness * (strain - ligament.toe_strain)


def stored(ligament, length):
    """Return ∫ T dℓ, by quadrature between the points at which T changes its form."""
    ends = ligament.slack_length * np.array([1.0, 1.0 + 2 * ligament.toe_strain])
    places = [ligament.slack_length, *[end for end in ends[1:] if end < length], length]
    pairs = pairwise(places)
    if length <= ligament.slack_length:
        return 0.0
    return sum(quad(lambda one: tension(ligament, one), a, b, epsabs=1e-13)[0] for a, b in pairs)
