"""The numbers of a run, shifted along a direction of its config."""

from collections.abc import Iterable

from rbstab.analysis.sensitivity import Shifted
from rbstab.config.build import input_legs, system_and_start
from rbstab.config.entries import shifted
from rbstab.config.schema import Config
from rbstab.config.source import Path
from rbstab.mechanics.derivatives import STEP


def shifted_along(config: Config, directions: Iterable[tuple[Path, float]]) -> Shifted:
    """Return the numbers of a run, shifted by ih along a direction, with h = `derivatives.STEP`.

    Args:
        config: The config of the run.
        directions: The paths of numbers of the config, and by how much the direction changes each.
    """
    changed = shifted(config, {path: 1j * STEP * change for path, change in directions})
    # Complex arithmetic may change the last digit of a breakpoint, which tells when a leg begins.
    # So the real parts are those of the given config.
    moved = input_legs(changed)
    legs = {name: legs + 1j * moved[name].imag for name, legs in input_legs(config).items()}
    return Shifted(*system_and_start(changed), legs)
