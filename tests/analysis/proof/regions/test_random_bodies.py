"""No region of a random body can be left, and no point is said to belong to a wrong minimum."""

from dataclasses import replace

import numpy as np
import pytest
from support.landscapes import end_of_flow, flooded
from support.proofs import rest_states
from support.rest import random_rest_system

from rbstab.analysis.proof.boxes import RANGE_END, Boxes
from rbstab.analysis.proof.certified_region import certified_region
from rbstab.analysis.proof.regions.downhill import Landscape
from rbstab.analysis.proof.regions.minimum_regions import minimum_regions
from rbstab.elements.gravity import Gravity
from rbstab.elements.rotational_stabilizer import RotationalStabilizer


def loaded_body(seed):
    """Return a random body, soft against rotation, under up to six times its weight."""
    rng = np.random.default_rng(seed)
    system = random_rest_system(rng, rng.choice(["permanent", "visco-elastic", "embedded"]))
    gravity, translational, rotational, *connector = system.elements
    assert isinstance(gravity, Gravity)
    assert isinstance(rotational, RotationalStabilizer)
    softness, load = 10 ** rng.uniform(-2.5, -0.3), 10 ** rng.uniform(-0.5, 0.8)
    soft = RotationalStabilizer(softness * rotational.K_r, rotational.L_r)
    elements = (Gravity(load * gravity.weight), translational, soft, *connector)
    return replace(system, elements=elements)


def points_near(rest, rng, count=25):
    """Return points in the range, near minima and saddles of index 1."""
    centres = [point.Theta for point in rest.states if point.index < 2]
    scales = 10 ** rng.uniform(-1.5, 0.2, size=(count, 1))
    points = rng.choice(centres, size=count) + scales * rng.normal(size=(count, 3))
    return points[np.all(np.abs(points) < 0.999 * RANGE_END, axis=1)]


@pytest.mark.slow
def test_regions_of_random_bodies():
    regions, several, tested = 0, 0, 0
    for seed in range(2000, 2012):
        rest = rest_states(loaded_body(seed), box_limit=60_000)
        form, border = rest.energy.form, certified_region(rest)
        found = minimum_regions(rest, border)
        regions, several = regions + len(found), several + (len(found) > 1)
        points = points_near(rest, np.random.default_rng(seed))
        for region in found:
            minimum = rest.states[region.state]
            assert flooded(form, rest, region.state, (41, 25, 41)) >= region.energy_bound
            landscape = Landscape(form, (minimum.enclosure,), RANGE_END)
            for Theta in points[form.value(points) < region.energy_bound]:
                box = Boxes(Theta[np.newaxis], Theta[np.newaxis])
                if landscape.reached_minimum(box, region.energy_bound) is not None:
                    assert end_of_flow(form, Theta) == pytest.approx(minimum.Theta, abs=1e-2)
                    tested += 1
    assert regions > 6
    assert several > 0
    assert tested > 10
