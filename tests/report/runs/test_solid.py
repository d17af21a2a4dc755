"""Protects the solid that stands for a body: its size follows the inertia of the body."""

from collections import Counter

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rbstab.mechanics.body import Body
from rbstab.report.runs.solid import MIN_THICKNESS, bone_of, semi_axes, solid_of

HALVES = np.array([0.3, 0.5, 1.1])


def ellipsoid(turn: np.ndarray, mass: float = 7.0) -> Body:
    """Return an ellipsoid of uniform density, with its textbook moments of inertia."""
    a, b, c = HALVES
    moments = mass / 5 * np.diag([b**2 + c**2, a**2 + c**2, a**2 + b**2])
    return Body(mass, turn @ moments @ turn.T, np.array([0.1, 0.0, 0.2]))


@pytest.fixture
def turn(rng: np.random.Generator) -> np.ndarray:
    # Normal components give each direction of the quaternion the same probability.
    return Rotation.from_quat(rng.normal(size=4)).as_matrix()


def test_an_ellipsoid_has_its_own_semi_axes(turn: np.ndarray) -> None:
    lengths, directions = semi_axes(ellipsoid(turn))
    np.testing.assert_allclose(lengths, HALVES, rtol=1e-12)
    np.testing.assert_allclose(np.abs(turn.T @ directions), np.eye(3), atol=1e-12)
    assert np.linalg.det(directions) == pytest.approx(1)


def test_a_bone_is_as_long_wide_and_thick_as_the_ellipsoid(turn: np.ndarray) -> None:
    corners = bone_of(ellipsoid(turn)).vertices @ turn
    np.testing.assert_allclose(np.abs(corners).max(axis=0), HALVES, rtol=0.02)
    np.testing.assert_allclose(corners.mean(axis=0), 0, atol=1e-12)


def test_a_box_has_the_sides_of_the_textbook(turn: np.ndarray) -> None:
    sides, mass = np.array([0.2, 0.5, 1.4]), 7.0
    moments = mass / 12 * np.diag((sides**2).sum() - sides**2)
    solid = solid_of(Body(mass, turn @ moments @ turn.T, np.zeros(3)))
    assert solid.is_real
    assert "box" in solid.words
    corners = solid.vertices @ turn
    for axis, side in enumerate(sides):
        np.testing.assert_allclose(np.ptp(corners[:, axis]), side, rtol=1e-9)


@pytest.mark.parametrize("moments", [[10.0, 8.0, 0.4], [3.0, 2.0, 1.0]], ids=["none", "flat"])
def test_moments_that_no_real_body_has_are_called_so(moments: list[float]) -> None:
    solid = solid_of(Body(41.0, np.diag(moments), np.zeros(3)))
    assert not solid.is_real
    assert "no real body has these moments" in solid.words


@pytest.mark.parametrize("shape", [bone_of, solid_of])
def test_a_shape_is_closed_and_its_triangles_look_outwards(shape, turn: np.ndarray) -> None:
    bone = shape(ellipsoid(turn))
    # At each end of the bone many corners coincide, and at the edges of a box some.
    place = {tuple(np.round(v, 9) + 0.0): n for n, v in enumerate(bone.vertices)}
    corner = [place[tuple(np.round(v, 9) + 0.0)] for v in bone.vertices]
    edges = Counter(
        (corner[t[i]], corner[t[(i + 1) % 3]]) for t in bone.triangles.tolist() for i in range(3)
    )
    assert all(count == 1 and edges[b, a] == 1 for (a, b), count in edges.items())
    a, b, c = (bone.vertices[bone.triangles[:, i]] for i in range(3))
    volume = (np.cross(a, b) * c).sum() / 6
    assert 0 < volume < 4 / 3 * np.pi * HALVES.prod() * (1 if shape is bone_of else 1.2)


def test_moments_that_no_body_has_still_make_a_bone_that_can_be_seen() -> None:
    # With 10 > 8 + 0.4 the mean square along the first axis would be negative.
    body = Body(41.0, np.diag([10.0, 8.0, 0.4]), np.array([0.15, 0.1, -0.42]))
    lengths, directions = semi_axes(body)
    longest = np.sqrt(5 * (10 + 8 - 0.4) / (2 * 41))
    middle = np.sqrt(5 * (10 + 0.4 - 8) / (2 * 41))
    np.testing.assert_allclose(lengths, [MIN_THICKNESS * longest, middle, longest], rtol=1e-12)
    np.testing.assert_allclose(np.abs(directions), np.eye(3), atol=1e-12)
