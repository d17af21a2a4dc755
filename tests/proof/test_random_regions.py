"""Regions of random energies: descents, rolling balls, and ways on a grid, without any bounds."""

from fractions import Fraction

import numpy as np
import pytest
from scipy.ndimage import label
from scipy.optimize import root

from rbstab.proof.boxes import Box
from rbstab.proof.enclosures.bounds import BoundedEnergy
from rbstab.proof.exact.expr import variable
from rbstab.proof.model import Energy
from rbstab.proof.regions.landscape import is_minimum
from rbstab.proof.regions.regions import regions_of
from rbstab.proof.search import Search

END = np.array([np.nextafter(np.pi, 4), np.nextafter(np.pi / 2, 2), np.nextafter(np.pi, 4)])
RANGE = Box(-END, END)
GRID = (33, 17, 33)


class Landscape:
    """A random energy: cosines and sines of the angles, and their products, above a bowl."""

    def __init__(self, seed):
        rng = np.random.default_rng(seed)
        self.bowl = np.array([2, 10, 2]) / 10
        self.single = rng.integers(-12, 13, size=(2, 3)) / 8
        self.products = rng.integers(-6, 7, size=(3, 3)) / 8
        x = [variable(k) for k in range(3)]
        U = sum((Fraction(self.bowl[k]) * x[k] * x[k] for k in range(3)), 0 * x[0])
        for k in range(3):
            c, s = self.single[:, k]
            U = U + Fraction(c) * (2 * x[k]).cos() + Fraction(s) * x[k].sin()
            for j in range(3):
                U = U + Fraction(self.products[k, j]) * x[k].sin() * x[j].cos()
        self.energy = Energy(U)

    def value(self, x):
        """Return U at points of shape (3, points)."""
        s, c = np.sin(x), np.cos(x)
        U = np.tensordot(self.bowl, x * x, 1) + np.tensordot(self.single[1], s, 1)
        U = U + np.tensordot(self.single[0], np.cos(2 * x), 1)
        return U + np.einsum("kj,k...,j...->...", self.products, s, c)

    def slope(self, x):
        """Return ∇U at one point."""
        s, c = np.sin(x), np.cos(x)
        gradient = 2 * self.bowl * x - 2 * self.single[0] * np.sin(2 * x) + self.single[1] * c
        return gradient + c * (self.products @ c) - s * (self.products.T @ s)


@pytest.fixture(scope="module", params=[1, 2])
def searched(request):
    """Return a landscape, its rest states, and their regions."""
    landscape = Landscape(request.param)
    zeros = Search(BoundedEnergy(landscape.energy.U), RANGE).run(20_000)
    assert zeros.proved
    return landscape, zeros, regions_of(landscape.energy, zeros, RANGE)


def test_the_rest_states_are_those_that_many_starts_find(searched):
    """SciPy's from 200 points, on the gradient in closed form; each index by differences."""
    landscape, zeros, _ = searched
    listed, seen = np.array([zero.point for zero in zeros.zeros]), set()
    for start in np.random.default_rng(1).uniform(-END, END, (200, 3)):
        x = root(landscape.slope, start, tol=1e-13).x
        if np.abs(landscape.slope(x)).max() < 1e-10 and np.all(np.abs(x) < END):
            seen.add(int(np.abs(listed - x).max(axis=1).argmin()))
            assert any(zero.domain.contains(x) for zero in zeros.zeros)
    assert len(seen) > len(listed) / 2
    for zero in zeros.zeros:
        assert np.abs(landscape.slope(zero.point)).max() < 1e-10
        ends = [zero.point + h for h in 1e-6 * np.vstack([np.eye(3), -np.eye(3)])]
        slopes = np.array([landscape.slope(x) for x in ends])
        assert zero.index == np.sum(np.linalg.eigvalsh(slopes[:3] - slopes[3:]) < 0)


def test_no_region_ends_above_a_way_on_a_grid(searched):
    """Each way on the grid from a minimum to another or the border is a way."""
    landscape, zeros, regions = searched
    axes = [np.linspace(-end, end, n) for end, n in zip(END, GRID, strict=True)]
    U = landscape.value(np.stack(np.meshgrid(*axes, indexing="ij")))
    # Between two nodes U is above both by h²/8 times the largest second derivative, at most.
    single = 4 * np.abs(landscape.single[0]) + np.abs(landscape.single[1])
    bent = (2 * landscape.bowl + single).max() + 2 * np.abs(landscape.products).sum()
    slack = bent * max(axis[1] - axis[0] for axis in axes) ** 2 / 8

    def node(x):
        return tuple(int(np.abs(axis - at).argmin()) for axis, at in zip(axes, x, strict=True))

    nodes = [node(zero.point) for zero in zeros.zeros]
    for region in regions.minima:
        parts, _ = label(region.energy_bound - slack > U)
        basin = (parts == parts[nodes[region.rest_state - 1]]) & (parts > 0)
        assert basin[1:-1, 1:-1, 1:-1].sum() == basin.sum()
        for at, zero in zip(nodes, zeros.zeros, strict=True):
            assert not basin[at] or at == nodes[region.rest_state - 1] or not is_minimum(zero)


def test_each_pass_is_a_saddle_or_on_a_face(searched):
    """It has the energy that is said, within the margin of the search."""
    landscape, zeros, regions = searched
    for region in regions.minima:
        x = np.array(region.pass_at)
        height = landscape.value(x) - landscape.value(zeros.zeros[region.rest_state - 1].point)
        assert region.level == pytest.approx(height, rel=1e-9)
        assert region.lower_bound <= region.level * (1 + 1e-12)
        assert region.lower_bound == pytest.approx(region.level, rel=2e-5)
        if region.pass_state is None:
            axis = int(region.pass_face[1]) - 1
            sign = -1 if "-" in region.pass_face else 1
            assert x[axis] == pytest.approx(sign * END[axis], rel=1e-15)
        else:
            zero = zeros.zeros[region.pass_state - 1]
            assert not is_minimum(zero)
            np.testing.assert_array_equal(zero.point, x)
