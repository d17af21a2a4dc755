"""The search for the factors of a tuning."""

import math

import numpy as np

from rbstab.analysis.sensitivity import baseline, derivative_along
from rbstab.config.build import problem_of
from rbstab.config.entries import moved
from rbstab.config.schema import Config
from rbstab.experiment.tuning.design import Design, scaled
from rbstab.experiment.tuning.objective import Objective
from rbstab.integrate.status import UnfinishedRunError
from rbstab.mechanics.derivatives import STEP
from rbstab.mechanics.numbers import Array

SAMPLES = 32
"""Configs that are tried all over the bounds, before gradients are followed."""

MAX_STEPS = 40
"""Steps of each descent."""

STEEP = 10.0
"""What stands, in a descent, for a run that failed: so many times the worst value seen."""

FAILURES = (UnfinishedRunError, ArithmeticError, ValueError)
"""What the run of a wild config may raise; a `ConfigError` is a ValueError."""


class Search:
    """The objective as a function of the logarithms x of the factors, and the best x met so far.

    Args:
        config: The config that is scaled.
        objective: What is to be small.
        designs: What is scaled.
        bounds: The least and the largest factor.
    """

    def __init__(
        self,
        config: Config,
        objective: Objective,
        designs: tuple[Design, ...],
        bounds: tuple[float, float],
    ) -> None:
        self.config, self.objective, self.designs = config, objective, designs
        self.bounds, self.logs = bounds, (math.log(bounds[0]), math.log(bounds[1]))
        self.best, self.best_value, self.worst = np.zeros(len(designs)), math.inf, 0.0
        self.runs = self.failures = 0

    def factors(self, x: Array) -> list[float]:
        """The factors at x, within the bounds to the last digit."""
        return np.clip(np.exp(x), *self.bounds).tolist()

    def config_at(self, x: Array) -> Config:
        """The scaled config.

        Raises:
            ConfigError: As `scaled`.
        """
        return scaled(self.config, self.designs, self.factors(x))

    def sample(self) -> list[Array]:
        """A Latin hypercube of the bounds, the same at every call."""
        rng = np.random.default_rng(0)
        shape = SAMPLES, len(self.designs)
        ranks = rng.permuted(np.tile(np.arange(SAMPLES)[:, None], shape[1]), axis=0)
        low, high = self.logs
        return list(low + (high - low) * (ranks + rng.uniform(size=shape)) / SAMPLES)

    def value(self, x: Array) -> float:
        """The objective; infinite where there is none."""
        return self.evaluated(x, gradient=False)[0]

    def descend(self, x: Array) -> None:
        """Follows the gradient from a point whose run is sound."""
        # Imported late: it takes longer than many runs.
        from scipy.optimize import minimize

        scale = self.value(x)
        if not 0 < scale < math.inf:
            return

        def function(x: Array) -> tuple[float, Array]:
            value, slope = self.evaluated(x, gradient=True)
            if not (math.isfinite(value) and np.isfinite(slope).all()):
                return STEEP * self.worst / scale, np.zeros(len(x))
            return value / scale, slope / scale

        limits = [self.logs] * len(x)
        options = {"maxiter": MAX_STEPS, "maxfun": 2 * MAX_STEPS}
        minimize(function, x, jac=True, method="L-BFGS-B", bounds=limits, options=options)

    def evaluated(self, x: Array, *, gradient: bool) -> tuple[float, Array]:
        """The objective and, on request, its gradient; a run that fails is worst."""
        self.runs += 1
        try:
            with np.errstate(all="ignore"):
                value, slope = self._run(x, gradient=gradient)
        except FAILURES:
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
        for index, design in enumerate(self.designs if gradient else ()):
            factor = self.factors(x)[index]
            # Along the logarithm of a factor a gain moves by itself.
            shift = {
                place: 1j * STEP * factor * entry.value
                for entry in design.entries
                for place in entry.places
            }
            slope[index] = self.objective.of(
                derivative_along(base, problem_of(moved(config, shift)))
            )
        return self.objective.of(base.outcome), slope
