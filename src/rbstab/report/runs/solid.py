"""The shape that represents a body: the box of its inertia, or a bone if no real body has it."""

import numpy as np

from rbstab.mechanics.body import Body
from rbstab.mechanics.numbers import Array
from rbstab.report.model.document import Solid

MIN_THICKNESS = 0.12
"""Shorter semi-axes are drawn with this fraction of the longest, so that they stay visible."""

SHAFT_RADIUS = 0.55
"""The radius of the shaft over the radius of the heads."""

HEAD_FRACTION = 0.42
"""The length of a head over half the length of the bone."""

CELLS = 4
"""Each face of a box is drawn as so many by so many squares: larger triangles have no one depth."""

THINNEST = 0.01
"""Shorter sides of a box are drawn with this fraction of the longest, so that they stay visible."""

RINGS, SIDES = 26, 24
"""Number of rings along the bone, and of vertices on each ring."""


def solid_of(body: Body) -> Solid:
    """Return the box of uniform density with a body's mass and moments; else a bone.

    With the principal moments j, its sides along the principal axes are
    a_i = √(6 (j_k + j_l - j_i) / m). If one j_i is not less than the sum of the two others, no real
    body has the moments, and a bone stands for the body (`bone_of`).
    """
    moments, directions = np.linalg.eigh(body.inertia)
    differences = moments.sum() - 2 * moments
    # Round-off must not make a body real whose moments are a border case.
    if not (differences > 1e-12 * moments.sum()).all():
        return bone_of(body)
    if np.linalg.det(directions) < 0:
        directions = directions * [-1.0, 1.0, 1.0]
    sides = np.sqrt(6 * differences / body.mass)
    vertices, triangles = _unit_cube()
    halves = 0.5 * sides.clip(min=THINNEST * sides.max())
    return Solid((vertices * halves) @ directions.T, triangles)


def _unit_cube() -> tuple[Array, Array]:
    """Return the cube from -1 to 1, each face in squares of two triangles that look outwards."""
    u, v = np.meshgrid(*(np.linspace(-1.0, 1.0, CELLS + 1),) * 2, indexing="ij")
    row, column = np.meshgrid(np.arange(CELLS), np.arange(CELLS), indexing="ij")
    corner = (row * (CELLS + 1) + column).ravel()
    right, above = corner + CELLS + 1, corner + 1
    face = np.concatenate(
        [np.column_stack([corner, right, right + 1]), np.column_stack([corner, right + 1, above])]
    )
    vertices: list[Array] = []
    triangles: list[Array] = []
    for axis in range(3):
        for side in (-1.0, 1.0):
            place = np.zeros((u.size, 3))
            place[:, axis] = side
            # In a cyclic order of the axes, u times v looks along the third one.
            place[:, (axis + 1) % 3], place[:, (axis + 2) % 3] = u.ravel(), v.ravel()
            triangles.append(len(vertices) * u.size + (face if side > 0 else face[:, ::-1]))
            vertices.append(place)
    return np.concatenate(vertices), np.concatenate(triangles)


def bone_of(body: Body) -> Solid:
    """Return a bone along the axis of the least moment.

    It has the length, width and thickness of the ellipsoid of uniform density with the body's mass
    and principal moments (`semi_axes`). Its shaft is thinner than its heads.
    """
    lengths, directions = semi_axes(body)
    along = np.cos(np.linspace(np.pi, 0.0, RINGS))
    around = np.linspace(0.0, 2 * np.pi, SIDES, endpoint=False)
    radius = _radius(along)
    unit = np.stack(
        [
            np.outer(radius, np.cos(around)),
            np.outer(radius, np.sin(around)),
            np.repeat(along[:, None], SIDES, axis=1),
        ],
        axis=-1,
    ).reshape(-1, 3)
    return Solid((unit * lengths) @ directions.T, _triangles(), is_real=False)


def semi_axes(body: Body) -> tuple[Array, Array]:
    """Return the semi-axes of the ellipsoid of uniform density with a body's mass and moments.

    For principal moments j, the mean square of the distance along axis i is
    s_i = (j_k + j_l - j_i) / 2m, and the semi-axis is √(5 s_i). If no real body has the moments,
    one s_i is negative and is set to zero. A semi-axis below `MIN_THICKNESS` times the longest is
    set to that value.

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
    return lengths.clip(min=MIN_THICKNESS * lengths[-1]), directions


def _radius(along: Array) -> Array:
    """Return the radius of the bone, at most 1, at positions from -1 to 1 along it."""
    from_end = 1 - np.abs(along)
    head = np.sqrt((from_end / HEAD_FRACTION * (2 - from_end / HEAD_FRACTION)).clip(min=0.0))
    swell = ((from_end - HEAD_FRACTION) / (1 - HEAD_FRACTION)).clip(0.0, 1.0)
    middle = SHAFT_RADIUS + (1 - SHAFT_RADIUS) * (
        0.5 + 0.5 * np.cos(np.pi * swell.clip(max=0.7) / 0.7)
    )
    return np.where(from_end <= HEAD_FRACTION, head, middle)


def _triangles() -> Array:
    """Return the corners of triangles between neighbouring rings, anticlockwise from outside."""
    ring, side = np.meshgrid(np.arange(RINGS - 1), np.arange(SIDES), indexing="ij")
    corner, next_corner = ring * SIDES + side, ring * SIDES + (side + 1) % SIDES
    lower = np.stack([corner, next_corner, next_corner + SIDES], axis=-1)
    upper = np.stack([corner, next_corner + SIDES, corner + SIDES], axis=-1)
    # The first and last rings are points, where one triangle of each pair has zero area.
    return np.concatenate([lower[1:].reshape(-1, 3), upper[:-1].reshape(-1, 3)])
