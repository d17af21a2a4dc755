"""The modes of a run at the rest state from which its v counts."""

from typing import NamedTuple

import numpy as np

from rbstab.analysis.configuration import ORIENTATION, POSITION, as_at_rest, configurations
from rbstab.analysis.descents.descent import numerical_hessian
from rbstab.analysis.linearisation import ROUND_OFF, NoDerivativesError, are_real, linearise
from rbstab.analysis.rest_state import rest_state_at
from rbstab.analysis.rest_system import smooth_rest_system
from rbstab.config.build import problem_of
from rbstab.config.schema import Config
from rbstab.config.user_code.permission import has_code
from rbstab.store.result import Result

GROWS = 1e-6
"""A mode grows if Re λ is larger than this, relative to the largest |λ|; less may be round-off."""

STAYS = 1e-12
"""A mode decays if Re λ is below minus this, on the same scale."""

ZERO = 10 * ROUND_OFF
"""An eigenvalue is 0 if |λ| is smaller, on the same scale: a double one is split by the root of the
errors of the matrix."""


class RestModes(NamedTuple):
    """The modes of the motion, linearised at rest.

    Attributes:
        frequencies: |λ| of each mode that oscillates, lowest first, rad/s.
        others: The number of modes that do not oscillate.
        slowest: The time constant of the slowest mode that decays, s; infinite if there is none.
        staying: The number of modes that neither decay nor grow.
        growing: The number of modes that grow: the rest state is unstable if there is one.
    """

    frequencies: list[float]
    others: int
    slowest: float
    staying: int = 0
    growing: int = 0

    def __str__(self) -> str:
        shown = ", ".join(f"{value:.4g}" for value in self.frequencies)
        parts = [f"natural frequencies {shown} rad/s"] if self.frequencies else []
        if self.others:
            several = "s" if self.others > 1 else ""
            parts.append(f"{self.others} real eigenvalue{several} (no oscillation)")
        if self.growing:
            parts.append(f"{_counted(self.growing, 'grows', 'grow')}: this rest state is unstable")
        elif self.staying == len(self.frequencies) + self.others:
            parts.append("no mode decays")
        else:
            of_others = ""
            if self.staying:
                parts.append(_counted(self.staying, "does not decay", "do not decay"))
                of_others = "of the others, "
            parts.append(f"{of_others}the slowest mode decays with τ = {self.slowest:.4g} s")
        return f"{'; '.join(parts)}; at the rest state where v = 0"


def _counted(count: int, singular: str, plural: str) -> str:
    return f"1 mode {singular}" if count == 1 else f"{count} modes {plural}"


@np.errstate(all="ignore")
def rest_modes(result: Result, config: Config | None) -> RestModes | None:
    """Return the modes of a run at rest; None if they are not known.

    Args:
        result: The result.
        config: Its config; None if this version cannot read it. The code of users is not run.
    """
    if config is None or has_code(config):
        return None
    system = smooth_rest_system(problem_of(config))
    at_rest = configurations(as_at_rest(system))
    q = at_rest.unloaded
    q[ORIENTATION] = result["rest_orientation"]
    if not at_rest.held:
        q[POSITION] = result["rest_position"]
    element_states = slice(at_rest.pose_size, None)
    if at_rest.size > at_rest.pose_size:
        # The energy is quadratic in the own states of our elements.
        stiffness = numerical_hessian(at_rest.gradient, q)[element_states, element_states]
        q[element_states] -= np.linalg.lstsq(stiffness, at_rest.gradient(q)[element_states])[0]
    rest = rest_state_at(at_rest, q)
    if not rest.is_at_rest:
        return None
    try:
        values = linearise(system, rest.motion, rest.element_states).eigenvalues
    except NoDerivativesError:
        return None
    size = np.abs(values).max()
    zero = np.abs(values) <= ZERO * size
    real = are_real(values) | zero
    grow, decay = values.real > GROWS * size, (values.real < -STAYS * size) & ~zero
    # Of a conjugate pair, one is counted.
    stay = (real | (values.imag > 0)) & ~grow & ~decay
    frequencies = sorted(np.abs(values[(values.imag > 0) & ~real]).tolist())
    if not frequencies and not decay.any():
        return None  # such a body has no rest state of its own
    slowest = -1 / float(values.real[decay].max()) if decay.any() else np.inf
    counts = int(real.sum()), slowest, int(stay.sum()), int(grow.sum())
    return RestModes(frequencies, *counts)
