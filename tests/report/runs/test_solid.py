"""Protects the solid that stands for a body: its size follows the inertia of the body."""

from collections import Counter

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rbstab.mechanics.body import Body
from rbstab.report.runs.solid import THINNEST, solid_of

SIDES = np.array([0.2, 0.5, 1.4])


def box(turn, mass=7.0):
    """Return a box of uniform density, with its textbook moments of inertia."""
    moments = mass / 12 * np.diag((SIDES**2).sum() - SIDES**2)
    return Body(mass, turn @ moments @ turn.T, np.array([0.1, 0.0, 0.2]))


@pytest.fixture
def turn(rng):
    # Normal components give each direction of the quaternion the same probability.
    return Rotation.from_quat(rng.normal(size=4)).as_matrix()


def test_a_box_has_the_sides_of_the_textbook(turn):
    solid = solid_of(box(turn))
    assert solid.is_real
    assert "box" in solid.words
    corners = solid.vertices @ turn
    np.testing.assert_allclose(np.ptp(corners, axis=0), SIDES, rtol=1e-9)


@pytest.mark.parametrize("moments", [[10.0, 8.0, 0.4], [3.0, 2.0, 1.0]], ids=["none", "flat"])
def test_moments_that_no_real_body_has_are_called_so(moments):
    solid = solid_of(Body(41.0, np.diag(moments), np.zeros(3)))
    assert not solid.is_real
    assert "no real body has these moments" in solid.words
    sides = np.ptp(solid.vertices, axis=0)
    assert sides.min() == pytest.approx(THINNEST * sides.max())


def test_the_shape_is_closed_and_its_triangles_look_outwards(turn):
    solid = solid_of(box(turn))
    # At the edges of a box some corners coincide.
    place = {tuple(np.round(v, 9) + 0.0): n for n, v in enumerate(solid.vertices)}
    corner = [place[tuple(np.round(v, 9) + 0.0)] for v in solid.vertices]
    edges = Counter(
        (corner[t[i]], corner[t[(i + 1) % 3]]) for t in solid.triangles.tolist() for i in range(3)
    )
    assert all(count == 1 and edges[b, a] == 1 for (a, b), count in edges.items())
    a, b, c = (solid.vertices[solid.triangles[:, i]] for i in range(3))
    assert (np.cross(a, b) * c).sum() / 6 == pytest.approx(SIDES.prod())
