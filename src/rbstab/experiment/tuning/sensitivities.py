"""Derivatives of the outcome of a run with respect to the numbers of its config."""

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from rbstab.analysis.linearisation import BODY_STATES
from rbstab.config.build import input_legs, problem_of, system_and_start
from rbstab.config.controllers import Implicit
from rbstab.config.load import load_config
from rbstab.config.numbers import Entry, entries_of, shifted
from rbstab.config.schema import Config
from rbstab.config.source import Path as KeyPath
from rbstab.files.text import line
from rbstab.integrate.engines import INSTALL_HEYOKA, EngineMissingError, engine
from rbstab.mechanics.derivatives import STEP
from rbstab.mechanics.numbers import Array
from rbstab.systems.quantities import BY_NAME

if TYPE_CHECKING:
    from rbstab.analysis.sensitivity import Baseline, Outcome, Shifted


class UnsuitedConfigError(ValueError):
    """The motion of a config has no derivatives, or they are not known."""


class OutcomeQuantity(NamedTuple):
    """One number of the outcome of a run: its name and its unit."""

    name: str
    unit: str


@dataclass(frozen=True, eq=False, repr=False)
class Sensitivities:
    """The derivatives ∂q/∂p of quantities q of a run with respect to numbers p of its config.

    Attributes:
        entries: The numbers p, n of them; `entry.key` is the key in the config, `entry.value` p.
        quantities: The quantities q, m of them, with `name` and `unit`: settling time, peaks of E
            and their times (unless C is held), final states.
        values: q, shape (m,); NaN for the settling time of a run that does not settle.
        derivatives: ∂q/∂p, shape (n, m), in the unit of q over the unit of p.
    """

    entries: tuple[Entry, ...]
    quantities: tuple[OutcomeQuantity, ...]
    values: Array
    derivatives: Array

    def __repr__(self) -> str:
        """Return one line: how many numbers and quantities there are."""
        sizes = f"{len(self.entries)} numbers", f"{len(self.quantities)} quantities"
        return line("Sensitivities", "", sizes)

    @cached_property
    def relative(self) -> Array:
        """The elasticities p/q ∂q/∂p, shape (n, m); NaN if q is zero, 0 if p is zero."""
        p = np.array([entry.value for entry in self.entries])
        with np.errstate(all="ignore"):
            relative: Array = p[:, None] * self.derivatives / self.values + 0.0  # -0 is 0
        return relative

    def column(self, name: str) -> int:
        """Return the column of a quantity in `values` and `derivatives`, by its name.

        Raises:
            ValueError: There is no such quantity.
        """
        names = [quantity.name for quantity in self.quantities]
        if name not in names:
            raise ValueError(f"no quantity {name!r} (expected one of {', '.join(names)})")
        return names.index(name)

    @property
    def settles(self) -> bool:
        """Whether the run has a settling time."""
        return bool(np.isfinite(self.values[self.column("settling_time")]))

    def by_importance(self, names: Iterable[str]) -> list[int]:
        """Return the indices of the entries, with the most influential entry first.

        An entry is sorted by its largest absolute elasticity over the named quantities. An entry
        with the value zero comes last.
        """
        chosen = np.abs(self.relative[:, [self.column(name) for name in names]])
        weight = np.nan_to_num(chosen, nan=0.0, posinf=np.inf).max(axis=1)
        return np.argsort(-weight, kind="stable").tolist()


def sensitivities(
    config: Config | str | Path | Mapping[str, Any], *, allow_python: bool = False
) -> Sensitivities:
    """Differentiate the outcome of a run with respect to the numbers of its config.

    For the state y and a number p, heyoka integrates the variational equation
    ż = (∂f/∂y) z + ∂f/∂p, z = ∂y/∂p, together with ẏ = f. Where an element switches, an input
    begins another leg, or the body meets its stop, z jumps (`integrate.switching.saltation`).

    The numbers are all gains, the numbers of inputs, the mass, the inertia, the contact point and
    the initial state. An off-diagonal entry of a symmetric matrix varies together with its mirror
    image. The mass also changes the weight, and shifts an anchor at equilibrium.

    Args:
        config: A config, or any argument that `load_config` takes.
        allow_python: As for `load_config`.

    Returns:
        The quantities and their derivatives, with units.

    Raises:
        ConfigError: The config is invalid.
        UnsuitedConfigError: Its motion has no derivatives, as one that is chaotic; or they are not
            known (`check_suited`).
        EngineMissingError: heyoka is not installed.
        UnfinishedRunError: The run did not complete.
    """
    config = load_config(config, allow_python=allow_python)
    check_suited(config)
    # Imported late: the engine must be installed, which was checked above.
    from rbstab.analysis.sensitivity import baseline

    entries = entries_of(config)
    # Overflow needs no warning: the status of the run reports a divergence.
    with unsuited_motions(), np.errstate(all="ignore"):
        base = baseline(problem_of(config))
        quantities, values = _quantities(base, base.outcome)
        rows = []
        for entry in entries:
            # The derivative by entry / size is about as large as the motion itself.
            size = abs(entry.value) or 1.0
            slope = outcome_slope(base, config, [(path, size) for path in entry.paths])
            rows.append(_quantities(base, slope)[1] / size)
    return Sensitivities(entries, quantities, values, np.array(rows))


def outcome_slope(
    base: "Baseline", config: Config, directions: Iterable[tuple[KeyPath, float]]
) -> "Outcome":
    """Return the derivative of the outcome of a run along a direction.

    Args:
        base: The run.
        config: Its config.
        directions: The paths of numbers of the config, and by how much the direction changes each.
    """
    from rbstab.analysis.sensitivity import derivative_along

    return derivative_along(base, shifted_along(config, directions))


def shifted_along(config: Config, directions: Iterable[tuple[KeyPath, float]]) -> "Shifted":
    """Return the numbers of a run, shifted by ih along a direction, with h = `derivatives.STEP`.

    Args:
        config: The config of the run.
        directions: As for `outcome_slope`.
    """
    from rbstab.analysis.sensitivity import Shifted

    changed = shifted(config, {path: 1j * STEP * change for path, change in directions})
    # Complex arithmetic may change the last digit of a breakpoint, which tells when a leg begins.
    # So the real parts are those of the given config.
    moved = input_legs(changed)
    legs = {name: legs + 1j * moved[name].imag for name, legs in input_legs(config).items()}
    return Shifted(*system_and_start(changed), legs)


def check_suited(config: Config) -> None:
    """Reject a config for which variational equations are not supported.

    Raises:
        UnsuitedConfigError: The connector slides in implicit steps, or sticks on s = E, or the
            coordinates are `manifold`.
        EngineMissingError: heyoka is not installed.
    """
    controller: Any = config.controller
    integration: Any = config.integration
    if isinstance(getattr(controller, "law", None), Implicit):
        raise UnsuitedConfigError(
            "controller.law: is implicit, so that the motion is made of steps "
            "(expected exact or boundary_layer)"
        )
    if getattr(controller, "stick_energy", 0.0):
        raise UnsuitedConfigError(
            f"controller.stick_energy: is {controller.stick_energy:g} J, so that the motion is "
            "changed where an axis sticks (expected 0)"
        )
    if integration.coordinates == "manifold":
        raise UnsuitedConfigError(
            "integration.coordinates: is 'manifold', which drifts (expected reduced)"
        )
    try:
        engine("heyoka")
    except EngineMissingError as error:
        raise EngineMissingError(
            f"derivatives of a run need heyoka, which cannot be used here: {error.__cause__}; "
            f"{INSTALL_HEYOKA}"
        ) from error


@contextmanager
def unsuited_motions() -> Iterator[None]:
    """Raise each `NotDifferentiableError` of the block as an `UnsuitedConfigError`."""
    from rbstab.integrate.switching.saltation import NotDifferentiableError

    try:
        yield
    except NotDifferentiableError as error:
        raise UnsuitedConfigError(str(error)) from error


def _quantities(base: "Baseline", outcome: "Outcome") -> tuple[tuple[OutcomeQuantity, ...], Array]:
    """Return the quantities of a run and their values, or the derivatives of these."""
    system = base.problem.system
    vectors = [("settling_time", "s", 1), ("peak_contact_displacement", "m", 3)]
    vectors += [("peak_time", "s", 3)]
    vectors += [(f"final.{name}", BY_NAME[name].unit, 3) for name in BODY_STATES]
    vectors += [(f"final.{state.name}", state.unit, state.size) for state in system.declared_states]
    values = np.concatenate(
        [[outcome.settling_time], outcome.peaks, outcome.peak_times, outcome.final]
    )
    quantities = [
        OutcomeQuantity(name if size == 1 and at == 0 else f"{name}[{axis}]", unit)
        for at, (name, unit, size) in enumerate(vectors)
        for axis in range(size)
    ]
    # A held contact point has no peaks.
    has_peaks = not system.coordinates.holds_contact
    kept = [k for k in range(len(values)) if has_peaks or not 1 <= k < 7]
    return tuple(quantities[k] for k in kept), values[kept]
