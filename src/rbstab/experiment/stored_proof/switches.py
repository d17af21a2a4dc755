"""Whether an element may switch just at a rest state of a proof."""

from dataclasses import replace

import numpy as np

from rbstab.analysis.configuration import configurations
from rbstab.analysis.rest_system import smooth_rest_system
from rbstab.config.build import problem_of, system_of
from rbstab.config.schema import Config
from rbstab.config.user_code.permission import without_code
from rbstab.elements.element import NO_STATE
from rbstab.proof.enclosures.bounds import BoundedEnergy
from rbstab.proof.enclosures.levels import range_of
from rbstab.proof.entries import ProvedState
from rbstab.proof.exact.expr import Expr, numbers, variable
from rbstab.proof.model import THETA


def may_switch(state: ProvedState, config: Config, name: str, first: int | None = None) -> bool:
    """Return whether an event function h of an element may be zero at a proved rest state.

    It is bounded over the enclosure of Θ. If h depends on the position too, as that of a ligament
    of a tied body, it is not known where it is zero.

    Args:
        state: The rest state; what is returned holds for all of its enclosure.
        config: The config of the proof.
        name: The name of an element that is no code of a user.
        first: How many of its first event functions count; None: all.
    """
    plain = without_code(config)
    coordinates = smooth_rest_system(problem_of(plain)).coordinates
    exact = configurations(replace(system_of(plain, numbers), coordinates=coordinates))
    motion = exact.motion(np.array([variable(k) for k in range(exact.size)], dtype=object))
    (element,) = (one for one in exact.system.elements if one.name == name)
    with np.errstate(all="ignore"):
        return any(_may_be_zero(h, state) for h in element.guards(motion, NO_STATE)[:first])


def _may_be_zero(event: Expr, state: ProvedState) -> bool:
    if not event.variables <= {*THETA}:
        return True
    bounds = range_of(BoundedEnergy(event).over(*np.array(state.enclosure)[:, :, None]))
    return bool(bounds.lo[0] <= 0 <= bounds.hi[0])
