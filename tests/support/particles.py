"""A body as particles, so that Newton's law for each is all the mechanics an oracle needs."""

import numpy as np


def particles(body):
    """Masses (n,) and places (n, 3) from the centre, of a body's mass, centre and inertia.

    A mass is negative where no real body has this inertia: every sum below is linear in the masses,
    so that nothing else changes.
    """
    second_moment = 0.5 * np.trace(body.inertia) * np.eye(3) - body.inertia
    moments, axes = np.linalg.eigh(second_moment)
    masses = np.concatenate([[body.mass - moments.sum()], moments / 2, moments / 2])
    return masses, np.vstack([np.zeros(3), axes.T, -axes.T])


def inertia_about(body, point):
    """The inertia about a point of the body, in body coordinates, particle by particle."""
    masses, places = particles(body)
    arms = places - point
    squares = np.einsum("nk,nk,n->", arms, arms, masses) * np.eye(3)
    return squares - np.einsum("ni,nj,n->ij", arms, arms, masses)
