"""Bodies with ligaments, and their energies by formulas of their own."""

from itertools import pairwise

import numpy as np
from scipy.integrate import quad
from scipy.optimize import minimize

from rbstab.elements.ligament import Ligament
from support.held_springs import DAMPING, K_R, K_T, WEIGHT, R
from support.pose import attitude
from support.tied_springs import K_C

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


def random_ligaments(rng, count, stiffest=2000.0):
    """Return ligaments between random points; some of them are slack at Θ = 0."""
    return [
        ligament_of(
            rng.normal(size=3) * 0.3,
            rng.normal(size=3) * 0.4,
            rng.uniform(50, stiffest),
            rng.uniform(0.1, 0.6),
            rng.uniform(0.02, 0.4),
            f"ligament {k}",
        )
        for k in range(count)
    ]


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


def held_energy(ligaments, Theta, soft=0.3):
    """Return the stored energy of `held_system` with ligaments at Θ."""
    X = R - attitude(Theta) @ R
    held = 0.5 * X @ K_T @ X - WEIGHT @ X + 0.5 * soft * Theta @ K_R @ Theta
    for one in ligaments:
        e = R + attitude(Theta) @ (one.point - R) - one.anchor
        held += stored(one, float(np.linalg.norm(e)))
    return float(held)


def tied_energy(ligaments, Theta, X, soft=1.0):
    """Return the stored energy of `tied_system` with ligaments at Θ and X."""
    A = attitude(Theta)
    E = X + A @ R - R
    held = 0.5 * X @ K_T @ X - WEIGHT @ X + 0.5 * soft * Theta @ K_R @ Theta + 0.5 * E @ K_C @ E
    for one in ligaments:
        held += stored(one, float(np.linalg.norm(X + A @ one.point - one.anchor)))
    return float(held)


def least_tied_energy(ligaments, Theta, soft=1.0):
    """Return the least `tied_energy` over X, and X: by a minimization of scipy."""
    found = minimize(
        lambda X: tied_energy(ligaments, Theta, X, soft),
        np.zeros(3),
        method="BFGS",
        options={"gtol": 1e-7},
    )
    found = minimize(
        lambda X: tied_energy(ligaments, Theta, X, soft),
        found.x,
        method="Nelder-Mead",
        options={"xatol": 1e-10, "fatol": 1e-13, "maxiter": 4000},
    )
    return float(found.fun), found.x
