"""Where a body should rest: the desired attitude of its config, or the default."""

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from rbstab.config.schema import Config
from rbstab.config.sections.body import Desired
from rbstab.mechanics.attitude import tilt


class Wanted(NamedTuple):
    """What is wanted of a body: `desired` of its config, or the default.

    Attributes:
        orientation: Θ of the desired attitude, rad.
        within: The largest tilt of a body that rests there, rad.
        is_default: Whether the config does not say it.
    """

    orientation: tuple[float, ...]
    within: float
    is_default: bool

    def __str__(self) -> str:
        pose = "upright" if not any(self.orientation) else f"Θ = {in_degrees(self.orientation)}"
        default = " (default)" if self.is_default else ""
        return f"{pose}{default}, within {math.degrees(self.within):.4g}°"

    def holds(self, Theta: Iterable[float]) -> bool:
        """Return whether a body that rests at Θ, rad, rests where it should."""
        return self.tilt(Theta) <= self.within

    def tilt(self, Theta: Iterable[float]) -> float:
        """Return the tilt of Θ, rad."""
        poses, desired = np.array([tuple(Theta)]), np.array(self.orientation)
        return float(tilt(poses, desired)[0])


def wanted(config: Config | None) -> Wanted:
    """Return what is wanted of the body of a config; None: the config cannot be read."""
    desired = None if config is None else config.desired
    section = desired or Desired()
    return Wanted(section.orientation, section.within, desired is None)


def in_degrees(Theta: Iterable[float]) -> str:
    """Return angles in degrees as text, such as (0°, 67.7°, 0°)."""
    return "(" + ", ".join(map(angle_in_degrees, Theta)) + ")"


def angle_in_degrees(angle: float) -> str:
    """Return an angle in degrees as text, to a tenth."""
    shown = round(math.degrees(angle), 1) + 0.0
    return f"{shown:g}°"
