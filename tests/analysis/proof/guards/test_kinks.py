"""Protects the angles at which the couple of a guard on θ2 jumps."""

import numpy as np

from rbstab.analysis.proof.guards.barrier import BarrierEnergy
from rbstab.analysis.proof.guards.guard import Guard
from rbstab.analysis.proof.guards.kinks import Kink, kink_at, kinks_of
from rbstab.analysis.proof.guards.soft import SoftEnergy


def soft(couple=0.0, stiffness=0.0, angle=0.5):
    return SoftEnergy(couple, stiffness, angle)


def test_a_kink_without_a_couple_is_none():
    guard = Guard(BarrierEnergy(1.0), (soft(stiffness=3.0), soft(couple=1.0, angle=0.8)))
    assert [kink.angle for kink in kinks_of(guard)] == [-0.8, 0.8]
    assert kink_at(guard, 0.5) is None
    assert Kink(-1, guard.soft[1]) == kink_at(guard, -0.8)
    assert kinks_of(None) == []


def test_a_kink_beyond_a_stop_is_none():
    guard = Guard(None, (soft(couple=1.0, angle=0.8), soft(couple=np.inf, angle=0.6)))
    assert [kink.angle for kink in kinks_of(guard)] == [-0.6, 0.6]
