"""Protects the animation of a run: the body is where the stored arrays put it, in few frames."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.paper_runs import paper_config

import rbstab
from rbstab.config.load import load_config
from rbstab.report.reading.sources import Run
from rbstab.report.runs.motion import MAX_FRAMES, animation_of


def run(variant, with_gravity=False, **changes):
    config = load_config(paper_config(variant, with_gravity, **changes))
    return Run(Path("a.h5"), rbstab.simulate(config), config, name="run-1", label="a")


@pytest.mark.parametrize(
    ("variant", "anchor"),
    [("permanent", "origin"), ("visco-elastic", "origin"), ("visco-elastic", "equilibrium")],
)
def test_the_contact_point_is_off_its_anchor_by_the_stored_displacement(variant, anchor):
    source = run(variant, with_gravity=True, controller={"anchor": anchor})
    motion = animation_of(source)
    at = np.searchsorted(source.result["time"], motion.times)
    turned = Rotation.from_quat(motion.rotations, scalar_first=True).apply(motion.contact_point)
    E = motion.positions + turned - motion.anchor
    np.testing.assert_allclose(E, source.result["contact_displacement"][at], atol=1e-12)


def test_a_view_has_no_more_frames_than_it_needs_and_both_ends():
    source = run("visco-elastic", samples=2001)
    motion = animation_of(source)
    assert len(motion.times) == MAX_FRAMES
    assert (motion.times[0], motion.times[-1]) == (0.0, 2.0)
    assert (np.diff(motion.times) > 0).all()
    steps = Rotation.from_quat(motion.rotations, scalar_first=True)
    # At (16, 32, -16) rad/s, the body turns by 0.22 rad in 2 s / 359.
    assert (steps[:-1].inv() * steps[1:]).magnitude().max() < 0.25


def test_a_free_body_is_tied_to_nothing():
    assert animation_of(run("free")).anchor is None


def test_without_a_config_there_is_no_body_to_show():
    source = run("free")
    with pytest.raises(ValueError, match="config cannot be read"):
        animation_of(Run(source.path, source.result, None))
