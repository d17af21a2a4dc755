"""Fitting: find numbers of a config from a measured motion."""

import math
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from rbstab.config.build import problem_of
from rbstab.config.errors import ConfigError
from rbstab.config.files.measured import Measured, read_measured
from rbstab.config.load import load_config, with_numbers
from rbstab.config.numbers import Entry, entries_of, unit_at
from rbstab.config.schema import Config
from rbstab.config.units import parse_key
from rbstab.experiment.tuning.fitted import Fitted, FittedColumn, FittedNumber, determined
from rbstab.experiment.tuning.gain_scaling import TuningError
from rbstab.experiment.tuning.sensitivities import check_suited, shifted_along, unsuited_motions
from rbstab.mechanics.numbers import Array

MAX_RUNS = 100
"""The largest number of runs of one search."""

MAX_WEIGHINGS = 20
"""How often the columns are weighed by their scatter."""

SAME_WEIGHT = 1e-3
"""The scatter of a column is known when it changes less than this, relatively."""

LEAST_SCATTER = 1e-9
"""SI: the scatter of a column is at least this; below is round-off."""

ALMOST_ZERO = 1e-6
"""A number that must be positive is almost 0 below this part of its given value."""

LARGEST_FACTOR = 1e4
"""A number that must be positive grows by this factor at most: stiffer motions take hours."""

STATIONARY = 0.05
"""A minimum is found if a step to it would be shorter than this, in standard errors."""


def fit(
    config: Config | str | Path | Mapping[str, Any],
    data: str | Path,
    free: str | Iterable[str],
    *,
    allow_python: bool = False,
) -> Fitted:
    """Fit numbers of a config to a measured motion, by least squares.

    The sum over all columns of (measured - computed)² / σ² becomes least, from the given values.
    Each column has its own σ: the scatter of its residuals, found again until it stays. The
    derivatives are those of variational equations. The intervals are those of the linearised
    motion; they hold if the model is right and the errors of measurement are independent, normal,
    and of one size in a column.

    Args:
        config: A config, or any argument that `load_config` takes.
        data: The CSV file of the measured motion (`read_measured`).
        free: Keys of numbers, such as `controller.K_r`, `body.inertia[0]`, `initial.orientation`;
            or a single key. All numbers below a key are free.
        allow_python: As for `load_config`.

    Returns:
        The fitted config, the numbers with their intervals, and the residuals.

    Raises:
        ConfigError: The config or the data are wrong.
        TuningError: `free` is wrong, or a column has too few values for it.
        UnsuitedConfigError: As for `sensitivities`.
        EngineMissingError: heyoka is not installed.
        UnfinishedRunError: The run of the given config did not complete.
    """
    config = load_config(config, allow_python=allow_python)
    check_suited(config)
    entries = _free_entries(config, [free] if isinstance(free, str) else free)
    measured = read_measured(data, config.integration.duration)
    counts = np.isfinite(measured.values).sum(axis=0)
    if counts.min() <= len(entries):
        name = measured.columns[counts.argmin()].name
        raise TuningError(
            f"{data}: {name}: has {counts.min()} values (expected more than the {len(entries)} "
            "free numbers)"
        )
    # Imported late: importing scipy.optimize takes longer than many runs.
    from scipy.optimize import least_squares

    motion = FreeMotion(config, entries, measured)
    x = np.zeros(len(entries))
    places = np.nonzero(np.isfinite(measured.values))[1]
    with unsuited_motions(), np.errstate(all="ignore"):
        motion.computed(x)
        for _ in range(MAX_WEIGHINGS):
            search = least_squares(
                motion.residuals, x, motion.jacobian, x_scale="jac", max_nfev=MAX_RUNS
            )
            x = search.x
            before = motion.scatter
            computed = motion.computed(x)
            uncertainty = determined(search.jac, search.fun, places)
            squares = np.nansum((measured.values - computed) ** 2, axis=0) / uncertainty.freedoms
            motion.scatter = np.maximum(np.sqrt(squares), LEAST_SCATTER)
            steady = np.allclose(motion.scatter, before, rtol=SAME_WEIGHT, atol=0.0)
            # Its status is 0 after too many runs.
            if steady or not search.status:
                break
    values, sizes = motion.numbers(x)
    with unsuited_motions(), np.errstate(all="ignore"):
        if (fallen := motion.fallen(x)).any():
            # Relative changes of a number that is almost 0 change nothing.
            sizes = np.where(fallen, motion.given, sizes)
            uncertainty = determined(motion.jacobian(x, sizes), search.fun, places)._replace(
                decrement=uncertainty.decrement
            )
    errors, half = np.abs(sizes) * [uncertainty.errors, uncertainty.halves]
    rows = np.stack([motion.given, values, errors, values - half, values + half]).T.tolist()
    # Over gaps, too: columns may be measured at other times.
    all_residuals = ((measured.values - computed) / motion.scatter).T
    residuals = (row[np.isfinite(row)] for row in all_residuals)
    rho = [float(series[1:] @ series[:-1]) / len(series) for series in residuals]
    columns = zip(measured.columns, counts.tolist(), motion.scatter.tolist(), rho, strict=True)
    return Fitted(
        motion.config_at(x),
        measured,
        tuple(
            FittedNumber(entry.key, unit_at(config, entry.key), *row)
            for entry, row in zip(entries, rows, strict=True)
        ),
        tuple(FittedColumn(column.name, column.unit, *row) for column, *row in columns),
        computed,
        uncertainty.loose,
        [entry.key for entry, is_fallen in zip(entries, fallen, strict=True) if is_fallen],
        steady and uncertainty.decrement < STATIONARY,
    )


def _free_entries(config: Config, keys: Iterable[str]) -> list[Entry]:
    """Return the numbers at some keys and below them; refuse a key without numbers of its own."""
    entries: list[Entry] = []
    for key in keys:
        path = parse_key(key) or (key,)
        below = [e for e in entries_of(config) if path in [p[: len(path)] for p in e.paths]]
        if not below or {*below} & {*entries}:
            raise TuningError(
                f"{key}: is no number to fit (expected numbers that `rbstab sensitivities` lists, "
                "each once)"
            )
        entries += below
    if not entries:
        raise TuningError("no number to fit (expected a key such as controller.K_r)")
    return entries


def _keeps_sign(config: Config, entry: Entry) -> bool:
    """Whether a config with the negative of a number is refused."""
    try:
        with_numbers(config, dict.fromkeys(entry.paths, -entry.value))
    except ConfigError:
        return True
    return False


class FreeMotion:
    """The motion of a config as a function of x, from 0: relative changes of its free numbers.

    A number that must be positive is p exp(x), for the given p; another one p + |p| x, or x if p is
    0. So a gain comes close to 0 without passing it.
    """

    def __init__(self, config: Config, entries: list[Entry], data: Measured) -> None:
        self.config, self.entries, self.data = config, entries, data
        self.given = np.array([entry.value for entry in entries])
        self.keeps_sign = np.array([_keeps_sign(config, entry) for entry in entries])
        self.scatter = np.ones(len(data.columns))

    def numbers(self, x: Array) -> tuple[Array, Array]:
        """Return the numbers at x, and their derivatives by x."""
        sizes = np.where(self.given, np.abs(self.given), 1.0)
        rates = np.where(self.keeps_sign, self.given * np.exp(self.keeps_sign * x), sizes)
        return np.where(self.keeps_sign, rates, self.given + sizes * x), rates

    def fallen(self, x: Array) -> Array:
        """Return which numbers fell to almost 0, below which a config is refused."""
        parts = np.where(self.keeps_sign, self.numbers(x)[0] / self.given, 1.0)
        return parts < ALMOST_ZERO

    def config_at(self, x: Array) -> Config:
        """Return the config with the numbers at x, validated."""
        pairs = zip(self.entries, self.numbers(x)[0].tolist(), strict=True)
        return with_numbers(self.config, {path: v for entry, v in pairs for path in entry.paths})

    def followed(self, config: Config) -> Any:
        """Return the function `followed_motion` of a config for what was measured."""
        # Imported late: the engine must be installed.
        from rbstab.analysis.followed_motion import followed_motion

        parts = [(column.vector, column.axis) for column in self.data.columns]
        return followed_motion(problem_of(config), self.data.times, parts)

    def computed(self, x: Array) -> Array:
        """Return what is computed for the measured values, shape (n, m).

        Raises:
            UnfinishedRunError: The run did not complete; or another error of extreme numbers.
        """
        values: Array = self.followed(self.config_at(x))(None)
        return values

    def residuals(self, x: Array) -> Array:
        """Return computed less measured in parts of the scatter.

        They are infinite if the run fails, or would be too stiff.
        """
        from rbstab.experiment.tuning.search import RUN_ERRORS

        if (self.keeps_sign * x <= math.log(LARGEST_FACTOR)).all():
            with suppress(*RUN_ERRORS):
                return self._weighed(self.computed(x) - self.data.values)
        return self._weighed(np.full(self.data.values.shape, np.inf))

    def jacobian(self, x: Array, sizes: Array | None = None) -> Array:
        """Return the derivatives of the residuals by x, exact to round-off.

        With sizes they are those by the numbers, each in parts of its size.
        """
        columns = []
        config = self.config_at(x)
        followed = self.followed(config)
        rates = self.numbers(x)[1] if sizes is None else sizes
        for entry, rate in zip(self.entries, rates.tolist(), strict=True):
            shifted = shifted_along(config, [(path, rate) for path in entry.paths])
            columns.append(self._weighed(followed(shifted)))
        return np.stack(columns, axis=1)

    def _weighed(self, values: Array) -> Array:
        return (values / self.scatter)[np.isfinite(self.data.values)]
