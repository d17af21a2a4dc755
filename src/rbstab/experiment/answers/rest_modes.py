"""The modes of a run at the rest state from which its v counts."""

from typing import NamedTuple

import numpy as np

from rbstab.analysis.configuration import ORIENTATION, POSITION, as_at_rest, configurations
from rbstab.analysis.descents.descent import numerical_hessian
from rbstab.analysis.linearisation import NoDerivativesError, are_real, linearise
from rbstab.analysis.rest_state import rest_state_at
from rbstab.analysis.rest_system import smooth_rest_system
from rbstab.config.build import problem_of
from rbstab.config.schema import Config
from rbstab.config.user_code.permission import has_code
from rbstab.store.result import Result

GROWS = 1e-6
"""A mode grows if Re λ is larger than this, relative to the largest |λ|; less may be round-off."""


class RestModes(NamedTuple):
    """The modes of the motion, linearised at rest.

    Attributes:
        frequencies: |λ| of each mode that oscillates, lowest first, rad/s.
        others: The number of modes that do not oscillate.
        slowest: The time constant of the slowest mode, s; infinite if one does not decay.
        growing: The number of modes that grow: the rest state is unstable if there is one.
    """

    frequencies: list[float]
    others: int
    slowest: float
    growing: int = 0

    def __str__(self) -> str:
        shown = ", ".join(f"{value:.4g}" for value in self.frequencies)
        parts = [f"natural frequencies {shown} rad/s"] if self.frequencies else []
        if self.others:
            parts.append(f"{self.others} modes do not oscillate")
        slowest = "one mode does not decay"
        if np.isfinite(self.slowest):
            slowest = f"the slowest mode decays with τ = {self.slowest:.4g} s"
        if self.growing:
            modes = "1 mode grows" if self.growing == 1 else f"{self.growing} modes grow"
            slowest = f"{modes}: this rest state is unstable"
        return f"{'; '.join([*parts, slowest])}; at the rest state where v = 0"


@np.errstate(all="ignore")
def rest_modes(result: Result, config: Config | None) -> RestModes | None:
    """Return the modes of a run at rest; None if they are not known.

    Args:
        result: The result.
        config: Its config; None if this version cannot read it. The code of users is not run.
    """
    if config is None or has_code(config) or "rest_position" not in result:
        return None
    system = smooth_rest_system(problem_of(config))
    at_rest = configurations(as_at_rest(system))
    q = at_rest.unloaded
    q[ORIENTATION] = result["rest_orientation"]
    if not at_rest.held:
        q[POSITION] = result["rest_position"]
    own = slice(at_rest.pose_size, None)
    if at_rest.size > at_rest.pose_size:
        # The energy is quadratic in the own states of our elements.
        stiffness = numerical_hessian(at_rest.gradient, q)[own, own]
        q[own] -= np.linalg.lstsq(stiffness, at_rest.gradient(q)[own])[0]
    rest = rest_state_at(at_rest, q)
    try:
        found = linearise(system, rest.motion, rest.own) if rest.is_at_rest else None
    except NoDerivativesError:
        return None
    if found is None:
        return None
    values, real = found.eigenvalues, are_real(found.eigenvalues)
    frequencies = sorted(np.abs(values[(values.imag > 0) & ~real]).tolist())
    slowest = -float(values.real.max())
    if not frequencies and not slowest > 0:
        return None  # such a body has no rest state of its own
    # Re λ of a mode without damping is round-off.
    growing = int((values.real > GROWS * np.abs(values).max()).sum())
    return RestModes(frequencies, int(real.sum()), 1 / slowest if slowest > 0 else np.inf, growing)
