"""The system whose exact motions are enclosed, and the size of its states."""

from dataclasses import replace

import numpy as np

from rbstab.analysis.configuration import configurations
from rbstab.analysis.motion_proof.motion import scale_of
from rbstab.config.build import Numbers, system_of
from rbstab.config.schema import Config
from rbstab.config.user_code.permission import has_code, without_code
from rbstab.integrate.problem import Problem
from rbstab.mechanics.numbers import Array
from rbstab.systems.coordinates import ReducedCoordinates
from rbstab.systems.system import System


def enclosed_system(config: Config, numbers: Numbers) -> System:
    """Return the system of a config in a kind of number; a held body has its six states.

    The exact motion of a held body stays on the submanifold, so these six states describe it.
    Elements of users are the formulas that their code states.

    Raises:
        NotRecordedError: The code of one of them cannot be recorded.
    """
    system = system_of(without_code(config), numbers)
    if has_code(config):
        system = _with_recorded(system, system_of(config), numbers)
    return _with_six_states(system) if system.coordinates.holds_contact else system


def state_scale(problem: Problem) -> Array:
    """Return the size of each state of the enclosed system, shape (n,)."""
    system = problem.system
    with np.errstate(all="ignore"):
        energy = float(np.abs(system.observe(problem.start).energy).sum())
    return scale_of(
        _with_six_states(system) if system.coordinates.holds_contact else system, energy
    )


def _with_six_states(system: System) -> System:
    return replace(system, coordinates=ReducedCoordinates())


def _with_recorded(system: System, whole: System, numbers: Numbers) -> System:
    """Return a system with the elements of users of another one, which is in doubles."""
    from rbstab.analysis.proof.traced.recorded import recorded_element

    at_rest, ours = configurations(whole), iter(system.elements)
    elements = (
        recorded_element(at_rest, one, numbers) if one.from_user else next(ours)
        for one in whole.elements
    )
    return replace(system, elements=tuple(elements))
