"""Watch the steps of a run for the first spring that has no length, and so no direction."""

from collections.abc import Callable

import numpy as np
from scipy.optimize import minimize_scalar

from rbstab.integrate.straight_line.equations import StraightLine
from rbstab.mechanics.derivatives import derivative_along
from rbstab.mechanics.numbers import Array
from rbstab.systems.system import System


class LengthWatch:
    """Watches the steps of a run for the first element whose statements end.

    Args:
        system: The system.
        size: The length of the audited state vectors.
    """

    def __init__(self, system: System, size: int) -> None:
        self.owners = system.clearance_owners
        self._values = StraightLine(System.clearances, system, size)
        self._rates: Array | None = None

    def stop_in_step(
        self,
        path: Callable[[], Callable[[float], Array]],
        times: tuple[float, float],
        state: Array,
        rates: Array,
    ) -> tuple[float, str] | None:
        """Return when the statements of an element end within a step, and the element.

        A length is smallest inside the step if it falls at the start and rises at the end.

        Args:
            path: Returns the motion along the step; called only if it is needed.
            times: The start and the end of the step, s.
            state: The state at the end.
            rates: Its rates there.
        """
        before, self._rates = self._rates, derivative_along(self._values, state, rates)
        if before is None:
            return None
        found = []
        for k in np.flatnonzero((before < 0) & (self._rates >= 0)).tolist():
            motion = path()

            def value(t: float, k: int = k, motion: Callable[[float], Array] = motion) -> float:
                return float(self._values(motion(t))[k])

            low = minimize_scalar(value, bounds=times, method="bounded", options={"xatol": 0.0})
            if low.fun <= 0:
                found.append((float(low.x), self.owners[k]))
        return min(found) if found else None
