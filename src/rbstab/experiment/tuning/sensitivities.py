"""The derivatives of a run's outcome with respect to the numbers of its config."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from rbstab.config.build import problem_of
from rbstab.config.entries import Entry, entries_of, moved
from rbstab.config.load import load_config
from rbstab.config.schema import Config
from rbstab.config.section import Section
from rbstab.integrate.engines import engine
from rbstab.mechanics.derivatives import STEP
from rbstab.mechanics.numbers import Array

if TYPE_CHECKING:
    from rbstab.analysis.sensitivity import Baseline, Outcome


class UnsuitedConfigError(ValueError):
    """The motion of a config has no derivative that could be followed here."""


class Quantity(NamedTuple):
    """One number by which a run is judged: its name and its unit."""

    name: str
    unit: str


@dataclass(frozen=True, eq=False)
class Sensitivities:
    """The derivatives of a run's outcome with respect to the numbers of its config.

    Attributes:
        entries: The numbers of the config, n of them.
        quantities: What is differentiated, m of them.
        values: The quantities of the run, shape (m,); NaN for a settling time that is not reached.
        derivatives: Shape (n, m), unit of the quantity over that of the entry.
    """

    entries: tuple[Entry, ...]
    quantities: tuple[Quantity, ...]
    values: Array
    derivatives: Array

    @cached_property
    def relative(self) -> Array:
        """The elasticities p/q ∂q/∂p, shape (n, m); NaN where q is zero, 0 where p is."""
        p = np.array([entry.value for entry in self.entries])
        with np.errstate(all="ignore"):
            relative: Array = p[:, None] * self.derivatives / self.values + 0.0  # -0 is 0
        return relative

    def column(self, name: str) -> int:
        """The index of the quantity of that name."""
        return [quantity.name for quantity in self.quantities].index(name)

    @property
    def settles(self) -> bool:
        """Whether the run has a settling time."""
        return bool(np.isfinite(self.values[self.column("settling_time")]))

    def by_importance(self, names: Iterable[str]) -> list[int]:
        """The indices of the entries, by falling size of their largest elasticity among names.

        A number that is zero has none, whatever it does, and stands last.
        """
        chosen = np.abs(self.relative[:, [self.column(name) for name in names]])
        weight = np.nan_to_num(chosen, nan=0.0, posinf=np.inf).max(axis=1)
        return np.argsort(-weight, kind="stable").tolist()


def sensitivities(config: Config | str | Path | Mapping[str, Any]) -> Sensitivities:
    """The sensitivities of a config's run, by heyoka's variational equations.

    The derivatives are with respect to every gain entry, mass, inertia, contact point and initial
    state of the config. An entry beside the diagonal of a symmetric matrix moves together with its
    mirror image; the mass is also a weight, and shifts an anchor at equilibrium.

    Args:
        config: A config, or what `load_config` takes.

    Raises:
        ConfigError: The config is wrong.
        UnsuitedConfigError: Its motion is not smooth, or in coordinates of the sub manifold.
        EngineMissingError: heyoka is not installed.
        UnfinishedRunError: The run did not complete.
    """
    if not isinstance(config, Section):
        config = load_config(config)
    check_suited(config)
    # Imported late, after the engine was found to be there.
    from rbstab.analysis.sensitivity import baseline

    entries = entries_of(config)
    # A diverging run is said by its status.
    with np.errstate(all="ignore"):
        base = baseline(problem_of(config))
        rows = [_derivatives(base, config, entry) for entry in entries]
    return Sensitivities(entries, _quantities(base), _row(base, base.outcome), np.array(rows))


def _derivatives(base: "Baseline", config: Config, entry: Entry) -> Array:
    from rbstab.analysis.sensitivity import derivative_along

    # In units of its size, a number's derivative is about as large as the motion itself.
    size = abs(entry.value) or 1.0
    shift = dict.fromkeys(entry.places, 1j * STEP * size)
    return _row(base, derivative_along(base, problem_of(moved(config, shift)))) / size


def check_suited(config: Config) -> None:
    """Refuses a config whose motion has no variational equations here.

    Raises:
        UnsuitedConfigError: The connector slides, or the coordinates are those of the sub manifold.
        EngineMissingError: heyoka is not installed.
    """
    controller: Any = config.controller
    integration: Any = config.integration
    if controller.variant == "sliding":
        raise UnsuitedConfigError(
            "controller.variant: is 'sliding', whose motion is not smooth "
            "(expected one of free, permanent, visco-elastic, embedded)"
        )
    if integration.coordinates == "manifold":
        raise UnsuitedConfigError(
            "integration.coordinates: is 'manifold', which drifts (expected reduced)"
        )
    engine("heyoka")


def _row(base: "Baseline", outcome: "Outcome") -> Array:
    peaks = [] if _held(base) else [*outcome.peaks, *outcome.peak_times]
    return np.array([outcome.settling_time, *peaks, *outcome.final], dtype=float)


def _quantities(base: "Baseline") -> tuple[Quantity, ...]:
    """The names of a row: a held point has no peaks, only an embedded connector a state."""
    found = [Quantity("settling_time", "s")]
    if not _held(base):
        found += _axes("peak_contact_displacement", "m")
        found += _axes("peak_time", "s")
    named = (
        ("final.orientation", "rad"),
        ("final.angular_velocity", "rad/s"),
        ("final.position", "m"),
        ("final.velocity", "m/s"),
        ("final.connector_state", "m"),
    )
    for name, unit in named[: len(base.outcome.final) // 3]:
        found += _axes(name, unit)
    return tuple(found)


def _axes(name: str, unit: str) -> list[Quantity]:
    return [Quantity(f"{name}[{axis}]", unit) for axis in range(3)]


def _held(base: "Baseline") -> bool:
    return base.problem.system.coordinates.holds_contact
