"""Search for the factors of a tuning; the numbers of a run, shifted along a direction."""

import math
from collections.abc import Iterable

import numpy as np

from rbstab.analysis.sensitivity import Shifted, baseline, derivative_along
from rbstab.config.build import input_legs, problem_of, system_and_start
from rbstab.config.numbers import shifted
from rbstab.config.schema import Config
from rbstab.config.source import Path
from rbstab.experiment.tuning.gain_scaling import GainScaling, scaled
from rbstab.experiment.tuning.objective import Objective
from rbstab.integrate.status import UnfinishedRunError
from rbstab.integrate.switching.saltation import NotDifferentiableError
from rbstab.mechanics.derivatives import STEP
from rbstab.mechanics.numbers import Array

SAMPLES = 32
"""Number of configs sampled within the bounds, before the descents."""

MAX_STEPS = 40
"""Maximum number of steps of each descent."""

FAILURE_PENALTY = 10.0
"""In a descent, a failed run counts as this many times the worst value seen."""

RUN_ERRORS = (UnfinishedRunError, ArithmeticError, ValueError)
"""Errors that a run with extreme gains may raise; a `ConfigError` is a ValueError."""


class Search:
    """The objective as a function of the logarithms x of the factors, and the best x so far.

    Args:
        config: The config to scale.
        objective: The number to minimize.
        scalings: The gains to scale.
        bounds: The smallest and the largest factor.
    """

    def __init__(
        self,
        config: Config,
        objective: Objective,
        scalings: tuple[GainScaling, ...],
        bounds: tuple[float, float],
    ) -> None:
        self.config, self.objective, self.scalings = config, objective, scalings
        self.bounds, self.logs = bounds, (math.log(bounds[0]), math.log(bounds[1]))
        self.best, self.best_value, self.worst = np.zeros(len(scalings)), math.inf, 0.0
        self.runs = self.failures = 0

    def factors(self, x: Array) -> list[float]:
        """Return the factors at x; rounding never moves them out of the bounds."""
        return np.clip(np.exp(x), *self.bounds).tolist()

    def config_at(self, x: Array) -> Config:
        """Return the config scaled by the factors at x.

        Raises:
            ConfigError: As `scaled`.
        """
        return scaled(self.config, self.scalings, self.factors(x))

    def sample(self) -> list[Array]:
        """Return a Latin hypercube sample of the bounds, the same at every call."""
        rng = np.random.default_rng(0)
        shape = SAMPLES, len(self.scalings)
        ranks = rng.permuted(np.tile(np.arange(SAMPLES)[:, None], shape[1]), axis=0)
        low, high = self.logs
        return list(low + (high - low) * (ranks + rng.uniform(size=shape)) / SAMPLES)

    def value(self, x: Array) -> float:
        """Return the objective at x; infinite if the run fails or has no finite objective."""
        return self.evaluate(x, gradient=False)[0]

    def descend(self, x: Array) -> None:
        """Descend along the gradient from x, if the objective at x is finite and positive."""
        # Imported late: importing scipy.optimize takes longer than many runs.
        from scipy.optimize import minimize

        scale = self.value(x)
        if not 0 < scale < math.inf:
            return

        def function(x: Array) -> tuple[float, Array]:
            value, slope = self.evaluate(x, gradient=True)
            if not (math.isfinite(value) and np.isfinite(slope).all()):
                return FAILURE_PENALTY * self.worst / scale, np.zeros(len(x))
            return value / scale, slope / scale

        limits = [self.logs] * len(x)
        options = {"maxiter": MAX_STEPS, "maxfun": 2 * MAX_STEPS}
        minimize(function, x, jac=True, method="L-BFGS-B", bounds=limits, options=options)

    def evaluate(self, x: Array, *, gradient: bool) -> tuple[float, Array]:
        """Return the objective at x and, if `gradient`, its gradient (otherwise zeros).

        The objective is infinite if the run fails or has no finite objective.

        Raises:
            NotDifferentiableError: The motion of the given config has no derivatives.
        """
        self.runs += 1
        try:
            with np.errstate(all="ignore"):
                value, slope = self._run(x, gradient=gradient)
        except RUN_ERRORS as error:
            if isinstance(error, NotDifferentiableError) and not x.any():
                raise
            value, slope = math.inf, np.zeros(len(x))
        if not math.isfinite(value):
            self.failures += 1
            return math.inf, slope
        self.worst = max(self.worst, value)
        if value < self.best_value:
            self.best_value, self.best = value, np.array(x)
        return value, slope

    def _run(self, x: Array, *, gradient: bool) -> tuple[float, Array]:
        config = self.config_at(x)
        base = baseline(problem_of(config))
        slope = np.zeros(len(x))
        for index, scaling in enumerate(self.scalings if gradient else ()):
            factor = self.factors(x)[index]
            # The derivative of a scaled gain with respect to log(factor) is the scaled gain.
            directions = [
                (place, factor * entry.value) for entry in scaling.entries for place in entry.paths
            ]
            outcome = derivative_along(base, shifted_along(config, directions))
            slope[index] = self.objective.of(outcome)
        return self.objective.of(base.outcome), slope


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
