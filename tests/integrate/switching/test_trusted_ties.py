"""Protects how far a motion with a tie that bounces on s = E is trusted."""

import numpy as np
import pytest
from support.sliding_ties import as_tie, several, sliding_example, tie

import rbstab


def bounced(surface, **integration):
    """Return the result of a turning body with a tie at its contact point."""
    elements = {"tie": tie([0.15, 0.1, -0.42], 20000.0, surface)}
    return rbstab.simulate(several(elements, **{"samples": 11, **integration}))


@pytest.mark.heavy
def test_a_tie_that_bounces_is_trusted_for_a_while():
    """After that time a start that differs in its last digit leads elsewhere."""
    config = as_tie(sliding_example("position_exact_20000", engine="heyoka", samples=101))
    run = rbstab.simulate(config)
    trusted = float(run["trusted_until"])
    assert 0.1 < trusted < 0.4
    spin = [16, 32, np.nextafter(-16, 0)]
    other = rbstab.simulate(config | {"initial": {"angular_velocity": spin}})
    difference = np.abs(run["contact_velocity"] - other["contact_velocity"]).max(axis=1)
    size = np.abs(run["contact_velocity"]).max()
    assert difference[run["time"] <= trusted / 2].max() < 1e-5 * size
    assert difference[run["time"] > trusted].max() > 1e-2 * size


def test_a_motion_that_is_not_chaotic_has_no_second_run():
    """It would only take time: a tie on a slope slides."""
    assert "trusted_until" not in bounced({"slope": 20.0}, duration=0.05).variables


def test_a_short_motion_is_trusted_to_its_end():
    assert bounced("position", duration=0.02)["trusted_until"] == 0.02
