"""Tuning: the gains that make an objective of a run small."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from rbstab.config.load import load_config
from rbstab.config.schema import Config
from rbstab.config.section import Section
from rbstab.experiment.tuning.design import Design, designs_of, retitled
from rbstab.experiment.tuning.objective import OBJECTIVES, Objective
from rbstab.experiment.tuning.sensitivities import UnsuitedConfigError, check_suited

IMPROVEMENT = 1e-6
"""An objective that is smaller by less than this part is not called better."""


@dataclass(frozen=True, eq=False)
class Tuned:
    """What a tuning found.

    Attributes:
        config: The better config; the given one where nothing better was found.
        objective: What was made small.
        designs: What was scaled.
        factors: By how much, in the order of the designs.
        given: The objective of the given config, infinite where its run fails or does not settle.
        value: The objective of `config`.
        runs: How many configs were tried.
        failures: How many of them did not complete, or did not settle.
    """

    config: Config
    objective: Objective
    designs: tuple[Design, ...]
    factors: tuple[float, ...]
    given: float
    value: float
    runs: int
    failures: int

    @property
    def better(self) -> bool:
        """Whether anything better was found."""
        return self.value < self.given


def tune(
    config: Config | str | Path | Mapping[str, Any],
    objective: str,
    over: Iterable[str],
    bounds: tuple[float, float] = (0.1, 10.0),
) -> Tuned:
    """Scales gains of a config so that an objective of its run becomes small.

    First a fixed sample of the bounds is tried, then gradients (variational equations) are followed
    by L-BFGS-B in the logarithms of the factors, from the given config and from the best of the
    sample; the best config that was met wins. That is a local optimum at least where the objective
    is smooth. It is not where another peak in time becomes the highest, or where v passes its
    threshold at a standstill: there a descent may stop early.

    Args:
        config: A config, or what `load_config` takes.
        objective: A key of `OBJECTIVES`.
        over: Keys of gains, such as `controller.L_c` or `controller.L_c[0]`.
        bounds: The least and the largest factor; 1 is between them.

    Raises:
        ConfigError: The config is wrong.
        UnsuitedConfigError: As for `sensitivities`; or the objective is fixed for this config.
        DesignError: `over` is wrong.
        EngineMissingError: heyoka is not installed.
        ValueError: There is no such objective, or the bounds do not hold 1.
    """
    if not isinstance(config, Section):
        config = load_config(config)
    check_suited(config)
    if objective not in OBJECTIVES:
        raise ValueError(f"objective: is '{objective}' (expected one of {', '.join(OBJECTIVES)})")
    chosen, designs = OBJECTIVES[objective], designs_of(config, over)
    variant: str = config.controller.variant
    if chosen.name == "peak_displacement" and variant == "permanent":
        raise UnsuitedConfigError(
            "controller.variant: is 'permanent', whose contact point does not move "
            "(expected another objective, or another variant)"
        )
    if not 0 < bounds[0] <= 1 <= bounds[1] < math.inf:
        raise ValueError("bounds: expected 0 < least factor <= 1 <= largest factor")
    # Imported late, after the engine was found to be there.
    from rbstab.experiment.tuning.search import Search

    search = Search(config, chosen, designs, bounds)
    given, start = search.value(np.zeros(len(designs))), np.zeros(len(designs))
    best_sample = min(search.sample(), key=search.value)
    for x in (start, best_sample):
        search.descend(x)
    if not search.best_value < given - IMPROVEMENT * abs(given if math.isfinite(given) else 0.0):
        ones = (1.0,) * len(designs)
        return Tuned(config, chosen, designs, ones, given, given, search.runs, search.failures)
    tuned = retitled(search.config_at(search.best), f", tuned for {chosen.name}")
    factors = tuple(search.factors(search.best))
    value = search.best_value
    return Tuned(tuned, chosen, designs, factors, given, value, search.runs, search.failures)
