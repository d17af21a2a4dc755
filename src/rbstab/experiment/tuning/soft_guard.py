"""A soft guard of θ2: the least strength with which a start is proved to keep the range.

What is proved of this start is theorem 11, with its independent check.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from rbstab.config.build import problem_of
from rbstab.config.schema import Config
from rbstab.elements.guards.soft_guards import SoftGuard
from rbstab.elements.registry import KINDS
from rbstab.experiment.answers.state_words import angles
from rbstab.experiment.proof import prove
from rbstab.experiment.simulate import simulate
from rbstab.experiment.stored_proof.proof import Proof, ProvedState
from rbstab.experiment.stored_proof.starts import OPEN_RANGE, start_bounds
from rbstab.experiment.tuning.guard import (
    RunOutcome,
    check_single,
    guard_name,
    guards_of,
    outcome_of,
    with_guard,
)
from rbstab.experiment.tuning.sensitivities import UnsuitedConfigError
from rbstab.integrate.status import RunStatus
from rbstab.proof.exact.expr import Expr
from rbstab.proof.kept_range import (
    Border,
    border_of_pitch,
    energy_at_most,
    energy_bound,
    guard_energy,
    nothing_rests_beyond,
)
from rbstab.proof.model import RANGE_END

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


NOT_DECIDED = "not decided"


class Unguarded(NamedTuple):
    """A start without a guard, and what is proved of it.

    Attributes:
        proof: The rest states of the config without the guard.
        border: The least energy on θ2 = ±π/2 without the guard.
        energy: An upper bound of the energy at the start, J.
        pitch: An upper bound of |θ2| at the start, rad.
    """

    proof: Proof
    border: Border
    energy: float
    pitch: float

    @property
    def is_inside(self) -> bool:
        """Whether the motion keeps the range without any guard."""
        return self.energy < self.border.energy


class NotDecidedError(Exception):
    """Nothing can be proved of a start with a soft guard; the text is the reason."""


class Kept(NamedTuple):
    """What is proved of one start with one guard.

    Attributes:
        energy: An upper bound of the energy at the start, with that of the guard, J.
        energy_bound: Motions with less energy keep the range, J.
        states: The rest states to one of which the motion converges; empty if it is not decided.
        reason: Why it is not decided.
    """

    energy: float
    energy_bound: float
    states: tuple[ProvedState, ...]
    reason: str

    @property
    def convergence(self) -> str:
        """Where the motion goes, as text."""
        if not self.states:
            return f"{NOT_DECIDED}: {self.reason}"
        if len(self.states) > 1:
            return f"to one of {len(self.states)} rest states: proved"
        return f"to the rest state at Θ = {angles(self.states[0].orientation)} rad: proved"


def unguarded(config: Config) -> Unguarded:
    """Prove what is needed of a config without its guard.

    Raises:
        NotDecidedError: The energy has no form that is proved, or no bounds.
    """
    problem = problem_of(config)
    proof = prove(config, problem)
    energy = None if proof.reduced_energy is None else proof.reduced_energy.energy
    if not (energy is None or energy.U.is_polynomial):
        raise NotDecidedError(
            "the least soft guard is not looked for beside springs, ligaments and some elements "
            "of users"
        )
    if energy is None:
        raise NotDecidedError(proof.outcome)
    if energy.stop is not None:
        raise NotDecidedError("a stop keeps every motion in the range")
    border = border_of_pitch(energy)
    if border is None:
        raise NotDecidedError("θ1 and θ3 have no bound that is small enough for a proof")
    start = start_bounds(problem)
    if start is None:
        raise NotDecidedError("the energy at the start has no proved bound")
    pitch = float(max(-start.low[1], start.high[1]))
    if not pitch <= OPEN_RANGE[1]:
        raise NotDecidedError("the start is not in the range |θ2| < π/2")
    return Unguarded(proof, border, start.energy, pitch)


def guard_of(method: str, strength: float, soft_angle: float) -> Expr:
    """Return the energy of a guard by its method, strength (k or K) and soft angle."""
    kind: Any = KINDS["guard"][method]
    return guard_energy(kind, strength, soft_angle)


def energy_with(start: Unguarded, guard: Expr) -> float:
    """Return an upper bound of the energy at a start with a guard, J."""
    return float(np.nextafter(start.energy + energy_at_most(guard, start.pitch), np.inf))


def keeps_range(start: Unguarded, guard: Expr) -> bool:
    """Return whether a motion with a guard is proved to keep the range."""
    return energy_with(start, guard) < energy_bound(start.border, guard)


def gains_of(method: str, strength: float, soft_angle: float) -> dict[str, float]:
    """Return the gains of a guard by their names; the first is its strength, k or K."""
    return {KINDS["guard"][method].gains[0].name: strength, "soft_angle": soft_angle}


def kept(start: Unguarded, method: str, strength: float, soft_angle: float) -> Kept:
    """Return what is proved of a start with a guard that keeps the range, and is confirmed.

    Raises:
        NotDecidedError: The checker does not confirm that it keeps the range.
    """
    from rbstab.proof.check.soft_guards import check_soft_guard

    guard, stored = guard_of(method, strength, soft_angle), start.proof.reduced_energy
    assert stored is not None
    nothing = nothing_rests_beyond(stored.energy, start.border, guard, soft_angle)
    bound = energy_bound(start.border, guard)
    claim = {
        "method": method,
        "strength": strength,
        "soft_angle": soft_angle,
        "end": start.border.end.tolist(),
        "energy_bound": bound,
        "nothing_beyond": nothing,
    }
    found = check_soft_guard(stored.model_dump(mode="json"), claim)
    refused = {finding.claim: finding.text for finding in found if not finding.verified}
    beyond = refused.pop("nothing at rest beyond", None)
    if refused:
        raise NotDecidedError(f"the checker refuses it: {' '.join(refused.values())}")
    nothing = nothing and beyond is None
    states, reason = _inner_states(start.proof, soft_angle, nothing_beyond=nothing)
    return Kept(energy_with(start, guard), bound, states, reason)


def _inner_states(
    proof: Proof, soft_angle: float, *, nothing_beyond: bool
) -> tuple[tuple[ProvedState, ...], str]:
    """Return the rest states with the guard, or none and the reason why they are not known."""
    wide = proof.unwrapped
    if wide is None or not wide.proved:
        return (), "the rest states for all real θ1 and θ3 are not proved"
    if not nothing_beyond:
        return (), "a rest state beyond the soft angle is not excluded"
    low, high = -soft_angle * (1 - 1e-15), soft_angle * (1 - 1e-15)
    inner = [s for s in wide.states if low < s.enclosure[0][1] and s.enclosure[1][1] < high]
    outer = [s for s in wide.states if s.enclosure[0][1] > high or s.enclosure[1][1] < low]
    if len(inner) + len(outer) != len(wide.states):
        return (), "a rest state lies at the soft angle"
    if not inner:
        return (), "no rest state lies within the soft angle"
    if not _rest_states_confirmed(proof):
        return (), "the checker does not confirm the rest states"
    return tuple(inner), ""


def _rest_states_confirmed(proof: Proof) -> bool:
    """Return whether the checker confirms all rest states for all real θ1 and θ3."""
    from rbstab.proof.check.checker import check
    from rbstab.proof.check.findings import EVERYWHERE

    record = proof.record
    wide = [one for one in record["ranges"] if one.get("everywhere")]
    lists = [one | {"level": None, "regions": [], "every_start": False} for one in wide]
    findings = [one for one in check(record | {"ranges": lists}) if one.about == EVERYWHERE]
    wanted = {"ends", "rest states", "no other rest state"}
    return wanted <= {one.claim for one in findings} and all(one.verified for one in findings)


def couple_bound(method: str, strength: float, soft_angle: float) -> float:
    """Return a bound of the couple of a guard while |θ2| < π/2, N m."""
    kind: Any = KINDS["guard"][method]
    gains = gains_of(method, strength, soft_angle)
    guard = kind(name="guard", mode=np.array([1.0, 0.0]), **gains)
    return float(guard.slope(RANGE_END[1]))


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
