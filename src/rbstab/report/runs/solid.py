"""The shape that represents a body: the box of its mass and moments."""

import numpy as np

from rbstab.mechanics.body import Body
from rbstab.mechanics.numbers import Array
from rbstab.report.model.document import Solid

CELLS = 4
"""Each face of a box is drawn as so many by so many squares: larger triangles have no one depth."""

THINNEST = 0.01
"""Shorter sides of a box are drawn with this fraction of the longest, so that they stay visible."""


def solid_of(body: Body) -> Solid:
    """Return the box of uniform density with a body's mass and moments.

    With the principal moments j, its sides along the principal axes are
    a_i = √(6 (j_k + j_l - j_i) / m). If one j_i is not less than the sum of the two others, no real
    body has the moments, and this side is drawn as `THINNEST`.
    """
    moments, directions = np.linalg.eigh(body.inertia)
    differences = moments.sum() - 2 * moments
    if np.linalg.det(directions) < 0:
        directions = directions * [-1.0, 1.0, 1.0]
    sides = np.sqrt(6 * differences.clip(min=0.0) / body.mass)
    vertices, triangles = _unit_cube()
    halves = 0.5 * sides.clip(min=THINNEST * sides.max())
    # Round-off must not make a body real whose moments are a border case.
    is_real = bool((differences > 1e-12 * moments.sum()).all())
    return Solid((vertices * halves) @ directions.T, triangles, is_real)


def _unit_cube() -> tuple[Array, Array]:
    """Return the cube from -1 to 1, each face in squares of two triangles that look outwards."""
    corners = np.arange((CELLS + 1) ** 2).reshape(CELLS + 1, CELLS + 1)
    corner, right, above = corners[:-1, :-1], corners[1:, :-1], corners[:-1, 1:]
    halves = (corner, right, corners[1:, 1:]), (corner, corners[1:, 1:], above)
    squares = np.concatenate([np.stack(half, axis=-1).reshape(-1, 3) for half in halves])
    across, up = np.linspace(-1.0, 1.0, CELLS + 1)[np.array(np.indices(corners.shape))]
    face = np.stack([across, up, np.ones_like(up)], axis=-1).reshape(-1, 3)
    # The face at z = 1, turned to each axis by a cyclic change of the axes. Its mirror image in the
    # centre is the opposite face; there a triangle looks outwards if its corners change places.
    faces = [side * np.roll(face, axis, axis=1) for axis in range(3) for side in (1, -1)]
    triangles = [squares, squares[:, ::-1]] * 3
    shifted = [
        corners.size * number + face_triangles for number, face_triangles in enumerate(triangles)
    ]
    return np.concatenate(faces), np.concatenate(shifted)
