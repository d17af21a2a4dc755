"""A body as particles: an oracle that needs Newton's law and nothing else."""

import numpy as np


def particles(body):
    """Return particles with the mass, centre and inertia of a body.

    A mass is negative where no real body has this inertia. Every sum in the tests is linear in the
    masses, so this changes nothing else.

    Returns:
        Masses (n,) and positions (n, 3) relative to the centre of gravity, in body coordinates.
    """
    second_moment = 0.5 * np.trace(body.inertia) * np.eye(3) - body.inertia
    moments, axes = np.linalg.eigh(second_moment)
    masses = np.concatenate([[body.mass - moments.sum()], moments / 2, moments / 2])
    return masses, np.vstack([np.zeros(3), axes.T, -axes.T])


def inertia_about(body, point):
    """Return the inertia about a point of the body, in body coordinates, summed over particles."""
    masses, places = particles(body)
    arms = places - point
    squares = np.einsum("nk,nk,n->", arms, arms, masses) * np.eye(3)
    return squares - np.einsum("ni,nj,n->ij", arms, arms, masses)
