"""Protects regions beside ridges: against passes on a grid, and points on the ridges."""

from functools import partial
from typing import Any

import numpy as np
import pytest
from flint import arb, ctx
from support.kinks import plane
from support.passes import ENDS, random_energy, way_out

from rbstab.analysis.proof_check import flood, regions
from rbstab.analysis.proof_check.claims import RestState
from rbstab.analysis.proof_check.cover import cover
from rbstab.analysis.proof_check.energy import Energy
from rbstab.analysis.proof_check.findings import Finding, range_with
from rbstab.analysis.proof_check.flood import WALL
from rbstab.analysis.proof_check.regions import OTHER_SIDE, Region
from rbstab.analysis.proof_check.taylor import Taylor

SLACK = 1e-6
"""rad: half the width of an enclosure."""

LIMIT = 3000
"""Boxes: a true claim that takes more is left out, to save time."""


@pytest.fixture(autouse=True)
def _precision() -> Any:
    with ctx.workprec(128):
        yield


def checked(U: Energy, start: Any, bound: float) -> Finding:
    """Check that motions below a bound that are near a point stay away from the border."""
    range_ = range_with("a range", tuple(arb(float(end)) for end in ENDS), closed=(2,))
    box = tuple((float(angle - SLACK), float(angle + SLACK)) for angle in start)
    state = RestState(1, 0, index_proved=True, point=start.tolist(), enclosure=box)
    claim = {"energy_bound": bound, "lower_bound": 0.0}
    return Region(U, claim, state, {}, range_).check_component()


def reasons(found: Finding) -> set[str]:
    return {reason for one in found.covers.values() for reason in one.tree}


@pytest.mark.parametrize(
    "seeds",
    [range(15), *(pytest.param(range(k, k + 50), marks=pytest.mark.heavy) for k in (15, 65))],
)
def test_no_region_reaches_over_a_way_out(seeds: range, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of random energies: no bound above a way out is verified, most bounds 20 % below it are."""
    monkeypatch.setattr(flood, "BOX_LIMIT", LIMIT)
    monkeypatch.setattr(regions, "cover", partial(cover, limit=LIMIT))
    tested, verified, used = 0, 0, set[str]()
    for seed in seeds:
        rng = np.random.default_rng(seed)
        energy = random_energy(rng)
        start, height = way_out(energy, rng)
        depth = height - float(energy.value(start))
        if depth < 1e-2:
            continue
        tested += 1
        U = Energy(energy.data)
        for above in (1e-9, rng.uniform(0, 0.3) * depth + 1e-7):
            assert not checked(U, start, height + above).verified
        found = checked(U, start, height - 0.2 * depth)
        verified += found.verified
        used |= reasons(found) if found.verified else set()
    assert verified > 0.6 * tested
    assert {f"{WALL}1", f"{WALL}2", OTHER_SIDE} <= used


def crossing_planes(rng: np.random.Generator) -> tuple[dict[str, Any], Any, Any, list[float]]:
    """Return an energy, a box about a point where three planes meet, and U on its two ridges.

    The first plane is a valley, the other two are ridges. U on a ridge is the least value at random
    points of it in the box.
    """
    normals, point = rng.normal(size=(3, 3)), rng.uniform(-0.5, 0.5, 3)
    offsets, couples = normals @ point, 10.0 ** rng.uniform(-1, 1, 3)
    bent, q = rng.normal(size=(3, 3)), rng.normal(size=3)
    Q = bent + bent.T
    numbers = zip(normals, offsets, couples, strict=True)
    planes = [{"name": "h", "operations": plane(*one)} for one in numbers]
    data = {"quadratic": Q.tolist(), "linear": q.tolist(), "coefficients": [[[0.0]]]}
    data |= {"kinks": planes[:1], "ridges": planes[1:]}

    def value(x: Any) -> Any:
        h = couples * (x @ normals.T - offsets)
        smooth = 0.5 * np.einsum("ni,ij,nj->n", x, Q, x) + x @ q
        return smooth + np.maximum(h[:, 0], 0) + np.minimum(h[:, 1:], 0).sum(axis=1)

    reach = 10.0 ** rng.uniform(-3, -0.5) * rng.uniform(0.2, 1, 3)
    box = tuple((float(a), float(b)) for a, b in zip(point - reach, point + reach, strict=True))
    lows = []
    for normal, offset in zip(normals[1:], offsets[1:], strict=True):
        inside = rng.uniform(point - reach, point + reach, (4000, 3))
        on = inside - np.outer(inside @ normal - offset, normal) / (normal @ normal)
        on = on[np.all(np.abs(on - point) <= reach, axis=1)]
        lows.append(float(value(on).min()))
    return data, box, reach, lows


def test_what_is_a_wall_is_above_the_bound() -> None:
    """Of ridges that cross in a box: each of them is found, and none that is below the bound."""
    found = list[int | None]()
    for seed in range(60):
        rng = np.random.default_rng(seed)
        data, box, reach, lows = crossing_planes(rng)
        taylor = Taylor(Energy(data), box)
        spread = float(np.ptp(lows)) + 1e-3 * float(reach.max())
        for bound in [*lows, *(min(lows) + spread * rng.uniform(-2, 2, 8))]:
            wall = taylor.wall(arb(float(bound) + 1e-12))
            assert wall is None or lows[wall] >= bound - 1e-9
            found.append(wall)
        assert taylor.wall(arb(min(lows) - 100 * (1 + abs(min(lows))))) == 0
    assert found.count(0) > 50
    assert found.count(1) > 50
    assert found.count(None) > 50
