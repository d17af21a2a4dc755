"""The least stiffness of a soft guard of θ2 with which a start is proved to keep the range."""

import math
from typing import Any, NamedTuple

from rbstab.config.schema import Config
from rbstab.elements.guards.soft_guards import SoftGuard
from rbstab.elements.registry import KINDS
from rbstab.experiment.simulate import simulate
from rbstab.experiment.tuning.guarded_run import (
    RunOutcome,
    check_single,
    guard_name,
    guards_of,
    outcome_of,
    with_guard,
)
from rbstab.experiment.tuning.kept_range import (
    Kept,
    NotDecidedError,
    Unguarded,
    couple_bound,
    gains_of,
    guard_of,
    keeps_range,
    kept,
    unguarded,
)
from rbstab.experiment.tuning.sensitivities import UnsuitedConfigError
from rbstab.integrate.status import RunStatus

METHODS = tuple(
    method
    for method, kind in KINDS["guard"].items()
    if method is not None and issubclass(kind, SoftGuard)
)
"""The methods of soft guards."""

SOFT_ANGLE = 1.2
"""rad: the soft angle if none is given."""

DIGITS = 3
"""The least strength is found among the numbers with so many digits."""

MOST_STRENGTH = 1e12
"""N m/rad or N m: stronger guards are not looked for; the start is too close to θ2 = ±π/2."""


class SoftlyGuarded(NamedTuple):
    """A config with a soft guard, and what the guard changes in its run.

    Attributes:
        config: The config with the guard; None if there is none, or if none is needed.
        strength: k, N m/rad, or K, N m; 0 if none is needed, None if there is none.
        kept: What is proved of the start; None without a guard.
        reason: Why there is no guard; empty if there is one.
        limit_kept: Whether the couple is known to stay below the limit in the run; None without a
            limit.
        couple_bound: A bound of the couple while the range is kept, N m; None without a guard.
        given: The run of the given config.
        guarded: The run of the config with the guard; None without one.
    """

    config: Config | None
    strength: float | None
    kept: Kept | None
    reason: str
    limit_kept: bool | None
    couple_bound: float | None
    given: RunOutcome
    guarded: RunOutcome | None


def soft_guard(
    config: Config, method: str, soft_angle: float = SOFT_ANGLE, limit: float | None = None
) -> SoftlyGuarded:
    """Find the least strength of a soft guard with which the start of a config keeps the range.

    The energy of the guard at θ2 = ±π/2 is its strength times a number, so the least strength is
    known in closed form; it is rounded up to `DIGITS` digits.

    Args:
        config: The config; a soft guard in it is replaced.
        method: One of `METHODS`.
        soft_angle: θ_s, rad, between 0 and π/2.
        limit: The largest couple that is allowed, N m, or None.

    Raises:
        UnsuitedConfigError: The config has several soft guards, or a barrier.
    """
    check_single(config, METHODS, "soft guards")
    for name in guards_of(config, ["barrier"]):
        raise UnsuitedConfigError(
            f"elements.{name}: is a barrier, which keeps every motion in the range "
            "(expected none beside a soft guard)"
        )
    name = guard_name(config, METHODS)
    given = outcome_of(simulate(config), config, name)
    nothing = SoftlyGuarded(None, None, None, "", None, None, given, None)
    try:
        start = unguarded(with_guard(config, None, METHODS))
        if start.is_inside:
            return nothing._replace(strength=0.0)
        strength = _least_strength(start, method, soft_angle)
        found = kept(start, method, strength, soft_angle)
    except NotDecidedError as error:
        return nothing._replace(reason=str(error))
    guard = {"kind": "guard", "method": method, **gains_of(method, strength, soft_angle)}
    guarded = with_guard(config, guard, METHODS)
    outcome = outcome_of(simulate(guarded), guarded, name)
    bound = couple_bound(method, strength, soft_angle)
    reason = "the run leaves the range numerically (integration.range_bound)"
    if outcome.status is not RunStatus.RANGE_LEFT:
        reason = ""
    return SoftlyGuarded(
        guarded if not reason else None,
        strength,
        found,
        reason,
        None if limit is None else _keeps(outcome, bound, limit),
        bound,
        given,
        outcome,
    )


def _keeps(outcome: RunOutcome, bound: float, limit: float) -> bool:
    """Return whether the couple of a run is known to stay below a limit: by proof, or as seen.

    It is seen only where the samples show the largest |θ2|.
    """
    return bound <= limit or (outcome.pitch_resolved and outcome.largest_couple <= limit)


def _least_strength(start: Unguarded, method: str, soft_angle: float) -> float:
    """Return the least number of `DIGITS` digits with which the motion is proved to keep the range.

    Raises:
        NotDecidedError: It is larger than `MOST_STRENGTH`.
    """
    kind: Any = KINDS["guard"][method]
    one = gains_of(method, 1.0, soft_angle)
    inner, outer = (
        float(kind(name="guard", mode=[float(angle > soft_angle), 0.0], **one).energy(angle))
        for angle in (start.pitch, math.pi / 2)
    )
    needed = start.energy - start.border.energy
    room = outer - inner
    strength = needed / room if room > 0 else math.inf
    if not strength < MOST_STRENGTH:
        raise NotDecidedError("the start is too close to θ2 = ±π/2 for a soft guard")
    number = _rounded_up(strength)
    while not keeps_range(start, guard_of(method, number, soft_angle)):
        number = _rounded_up(number * (1 + 0.5 * 10.0**-DIGITS))
    return number


def _rounded_up(number: float) -> float:
    """Return the least number of `DIGITS` digits that is not below a number."""
    unit = 10.0 ** (math.floor(math.log10(number)) + 1 - DIGITS)
    return float(f"{math.ceil(number / unit) * unit:.{DIGITS}g}")
