"""The natural frequencies of a run at the rest state from which its v counts."""

import numpy as np

from rbstab.analysis.configuration import ORIENTATION, POSITION, as_at_rest, configurations
from rbstab.analysis.linearisation import NoDerivativesError, are_real, linearise
from rbstab.analysis.rest_state import numerical_hessian, rest_state_at
from rbstab.analysis.rest_system import smooth_rest_system
from rbstab.config.build import problem_of
from rbstab.config.schema import Config
from rbstab.config.user_code.permission import has_code
from rbstab.store.result import Result


@np.errstate(all="ignore")
def rest_frequencies(result: Result, config: Config | None) -> list[float]:
    """Return |λ| of each mode that oscillates, lowest first, rad/s; none if they are not known.

    Args:
        result: The result.
        config: Its config; None if this version cannot read it. The code of users is not run.
    """
    if config is None or has_code(config) or "rest_position" not in result:
        return []
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
        return []
    if found is None:
        return []
    values = found.eigenvalues[(found.eigenvalues.imag > 0) & ~are_real(found.eigenvalues)]
    return sorted(np.abs(values).tolist())
