"""Convexity and directions of a family: never true where a body has another rest state."""

import numpy as np
import pytest
from support.bodies import box_of, config_of, member, some_bodies

from rbstab.analysis.proof.boxes import Boxes, box_around
from rbstab.analysis.proof.enclosure import enclosure
from rbstab.analysis.proof.reduced_energy import reduced_energy
from rbstab.analysis.proof.robust.convexity import convex_on, curvature_at, isolated_minimum
from rbstab.analysis.proof.robust.directions import FamilyTests
from rbstab.analysis.proof.robust.energies import energies_of
from rbstab.analysis.proof.searches.zeros import search

HEAVY = [0.0, 1.0, -9.81]

CASES = [
    ("permanent", {}, ["controller=±30%", "body.contact_point=±0.01"]),
    ("permanent", {"gravity": HEAVY}, ["controller=±3%", "gravity=±0.1"]),
    ("visco-elastic", {"gravity": HEAVY}, ["controller=±10%", "body.mass=±5%"]),
    ("embedded", {}, ["controller=±20%"]),
]


def hessian_of(members, numbers, Theta):
    return reduced_energy(member(members, numbers)).form.approximate(Theta[np.newaxis], 2)[2][0]


@pytest.mark.parametrize(("variant", "sections", "texts"), CASES)
def test_curvature_is_a_lower_bound(variant, sections, texts):
    rng = np.random.default_rng(5)
    members, part = box_of(config_of(variant, **sections), *texts)
    family = energies_of(members, part).family
    Theta = search(family.middle)[0]
    curvature = curvature_at(family, Theta)
    assert curvature is not None
    F, least = curvature.factor, np.inf
    for numbers in some_bodies(part, rng, 40):
        hessian = F @ hessian_of(members, numbers, Theta) @ F.T
        least = min(least, float(np.linalg.eigvalsh(hessian).min()))
    assert curvature.bound <= least
    assert curvature.bound >= 0.5 * least


@pytest.mark.parametrize(("variant", "sections", "texts"), CASES)
def test_the_rest_state_of_each_body_is_in_the_enclosure(variant, sections, texts):
    rng = np.random.default_rng(6)
    members, part = box_of(config_of(variant, **sections), *texts)
    family = energies_of(members, part).family
    zero = isolated_minimum(family, search(family.middle)[0])
    assert zero is not None
    assert convex_on(family, zero.enclosure)
    spread = 0.0
    for numbers in some_bodies(part, rng, 30):
        form = reduced_energy(member(members, numbers)).form
        states = search(form, starts=20)
        inside = [Theta for Theta in states if zero.domain_contains(Theta)]
        assert len(inside) == 1
        assert np.all(inside[0] >= zero.enclosure.low - 1e-12)
        assert np.all(inside[0] <= zero.enclosure.high + 1e-12)
        spread = max(spread, float(np.abs(inside[0] - zero.Theta).max()))
    if sections:
        # Under a load the rest state moves with the body, and the enclosure is not far too wide.
        assert spread > 0.05 * zero.radius


def test_saddle_is_no_minimum():
    members, part = box_of(config_of("permanent", scale=0.1), "controller.K_t=±0.1%")
    family = energies_of(members, part).family
    saddle = search(family.middle)[1]
    assert curvature_at(family, saddle) is None
    assert isolated_minimum(family, saddle) is None


def test_convexity_ends_before_a_saddle():
    """On the way to another rest state U is not convex, for any box that contains both."""
    members, part = box_of(config_of("permanent", scale=0.1), "controller.K_t=±0.1%")
    family = energies_of(members, part).family
    lowest, saddle = search(family.middle)[:2]
    whole = box_around(lowest, float(np.abs(saddle - lowest).max()))
    assert not convex_on(family, whole)
    assert convex_on(family, box_around(lowest, 1e-3))


@pytest.mark.parametrize("scale", [0.1, 0.3, 1.0])
@pytest.mark.parametrize(("variant", "sections", "texts"), CASES)
def test_no_box_with_a_rest_state_is_left_out(variant, sections, texts, scale):
    rng = np.random.default_rng(7)
    members, part = box_of(config_of(variant, scale=scale, **sections), *texts)
    family = energies_of(members, part).family
    tests = FamilyTests(family, centre=search(family.middle)[0])
    excluded, checked = 0, 0
    for numbers in some_bodies(part, rng, 10):
        for Theta in search(reduced_energy(member(members, numbers)).form, starts=200):
            radius = 10.0 ** rng.uniform(-8, -0.5, size=(40, 1))
            offset = rng.uniform(-1, 1, size=(40, 3)) * radius
            boxes = Boxes(Theta + offset - radius, Theta + offset + radius)
            assert not np.any(tests.excludes_zero(boxes, enclosure(family, boxes)))
            assert not np.any(enclosure(family, boxes).monotonic)
            checked += 1
    assert checked >= 10
    far = rng.uniform(-1, 1, size=(200, 3)) * [3.1, 1.5, 3.1]
    boxes = Boxes(far - 1e-3, far + 1e-3)
    excluded = int(tests.excludes_zero(boxes, enclosure(family, boxes)).sum())
    assert excluded > 100


@pytest.mark.parametrize("tolerance", ["±0.01%", "±10%"])
def test_a_direction_in_which_all_energies_rise(tolerance):
    """In a box that is left out, the slope along one of the directions has one sign everywhere."""
    rng = np.random.default_rng(11)
    members, part = box_of(config_of("permanent", scale=0.3), f"controller={tolerance}")
    family = energies_of(members, part).family
    tests = FamilyTests(family, centre=np.zeros(3))
    centre = rng.uniform(-1, 1, size=(3000, 3)) * [3, 1.5, 3]
    radius = rng.uniform(0.1, 0.6, size=(3000, 1))
    boxes = Boxes(centre - radius, centre + radius)
    enclosed = enclosure(family, boxes)
    excluded = tests.excludes_zero(boxes, enclosed)
    assert excluded.sum() > 20
    gradients, _ = family.gradients(boxes.centre)
    directions = tests._directions(boxes.centre, gradients[:, 0], enclosed.hessian)
    numbers = some_bodies(part, rng, 6)
    forms = [reduced_energy(member(members, one)).form for one in numbers]
    for place in np.flatnonzero(excluded):
        signs = rng.choice([-1.0, 1.0], size=(40, 3)) * rng.choice([0.5, 1.0], size=(40, 1))
        Theta = boxes.centre[place] + signs * radius[place]
        slopes = np.concatenate([form.approximate(Theta, 1)[1] for form in forms])
        rises = [slopes @ y[place] for y in directions]
        assert any(np.all(rise > 0) or np.all(rise < 0) for rise in rises)
