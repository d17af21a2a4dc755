"""The switches of a run, as a trajectory holds them."""

from enum import StrEnum
from typing import NamedTuple

from rbstab.mechanics.numbers import Array


class Transition(StrEnum):
    """How an axis changed its mode, other than by crossing the surface."""

    STICK = "stick"
    RELEASE = "release"


class SwitchTrace(NamedTuple):
    """The switching of a run along its samples, and its switches.

    modes (n, 3) is -1, 0 or 1 for each axis; counts (n, 3) are the switches so far; chatter_energy
    (n,) and discarded_energy (n,), J; switch_times and switch_axes are those of the first switches;
    transitions are all sticks and releases; trusted_until, s, is how far the motion is reproducible
    in double precision (the slow quantities, Θ and e, are meaningful beyond it). chatter_energy
    and trusted_until are NaN where the problem is not diagnosed.
    """

    modes: Array
    counts: Array
    chatter_energy: Array
    discarded_energy: Array
    switch_times: Array
    switch_axes: Array
    transitions: list[tuple[float, int, Transition]]
    trusted_until: float
