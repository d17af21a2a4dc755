"""The shape by which a body is shown: a bone, as long, wide and thick as its inertia says."""

import numpy as np

from rbstab.mechanics.body import Body
from rbstab.mechanics.numbers import Array
from rbstab.report.model.document import Solid

THINNEST = 0.12
"""Of the longest semi-axis: no solid is drawn thinner, so that one can see it."""

SHAFT = 0.55
"""The girth of the shaft over that of the heads."""

HEAD = 0.42
"""The part of each half of the bone that is head."""

RINGS, SIDES = 26, 24


def bone_of(body: Body) -> Solid:
    """A bone along the axis of the least moment, within the body's ellipsoid of inertia.

    It is as long, wide and thick as the ellipsoid of even density with the body's mass and
    principal moments (`semi_axes`); its shaft is slimmer than its heads.
    """
    lengths, directions = semi_axes(body)
    along = np.cos(np.linspace(np.pi, 0.0, RINGS))
    around = np.linspace(0.0, 2 * np.pi, SIDES, endpoint=False)
    girth = _girth(along)
    unit = np.stack(
        [
            np.outer(girth, np.cos(around)),
            np.outer(girth, np.sin(around)),
            np.repeat(along[:, None], SIDES, axis=1),
        ],
        axis=-1,
    ).reshape(-1, 3)
    return Solid((unit * lengths) @ directions.T, _triangles())


def semi_axes(body: Body) -> tuple[Array, Array]:
    """The semi-axes of the ellipsoid of even density with a body's mass and principal moments.

    With the moments j of an ellipsoid, the mean square of the distance along axis i is
    s_i = (j_k + j_l - j_i) / 2m, and its semi-axis is √(5 s_i). Where the moments are those of no
    real body, one of these is negative: it is taken as zero, and then, like any that is too small
    to be seen, as `THINNEST` of the longest.

    Returns:
        The semi-axes, ascending, shape (3,), m; and their directions in body coordinates, columns
        of a rotation, shape (3, 3).
    """
    moments, directions = np.linalg.eigh(body.inertia)
    mean_squares = (moments.sum() - 2 * moments) / (2 * body.mass)
    lengths = np.sqrt(5 * mean_squares.clip(min=0.0))
    order = np.argsort(lengths, kind="stable")
    lengths, directions = lengths[order], directions[:, order]
    if np.linalg.det(directions) < 0:
        directions = directions * [-1.0, 1.0, 1.0]
    return lengths.clip(min=THINNEST * lengths[-1]), directions


def _girth(along: Array) -> Array:
    """The radius at each place along the bone, of 1, from -1 to 1: two heads and a shaft."""
    from_end = 1 - np.abs(along)
    head = np.sqrt((from_end / HEAD * (2 - from_end / HEAD)).clip(min=0.0))
    swell = ((from_end - HEAD) / (1 - HEAD)).clip(0.0, 1.0)
    middle = SHAFT + (1 - SHAFT) * (0.5 + 0.5 * np.cos(np.pi * swell.clip(max=0.7) / 0.7))
    return np.where(from_end <= HEAD, head, middle)


def _triangles() -> Array:
    """The corners of the triangles between neighbouring rings, outward side anticlockwise."""
    ring, side = np.meshgrid(np.arange(RINGS - 1), np.arange(SIDES), indexing="ij")
    here, there = ring * SIDES + side, ring * SIDES + (side + 1) % SIDES
    lower = np.stack([here, there, there + SIDES], axis=-1)
    upper = np.stack([here, there + SIDES, here + SIDES], axis=-1)
    # The first and the last ring are points, where one triangle of each pair has no area.
    return np.concatenate([lower[1:].reshape(-1, 3), upper[:-1].reshape(-1, 3)])
