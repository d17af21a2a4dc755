"""Attempts to prove that all disturbances below a bound keep a body near its rest state."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from fractions import Fraction

import numpy as np

from rbstab.analysis.configuration import configurations, without_inputs
from rbstab.config.build import problem_of, supplies_power, system_of
from rbstab.config.quantities import ZERO
from rbstab.config.schema import Config
from rbstab.config.user_code.permission import of_users, without_code
from rbstab.experiment.answers.state_words import angles
from rbstab.experiment.disturbed.bound import Bound, Largest, Sizes, names_of
from rbstab.experiment.disturbed.breaking import smallest_breaking
from rbstab.files.text import grouped
from rbstab.mechanics.attitude import tilt as tilt_of
from rbstab.proof.disturbed.candidates import Samples
from rbstab.proof.disturbed.forms import Forms, Load, NoFormsError, forms_of
from rbstab.proof.disturbed.invariant import prove
from rbstab.proof.disturbed.matrices import Matrices
from rbstab.proof.disturbed.record import Stated, claim_record
from rbstab.proof.exact.decimals import as_decimal
from rbstab.proof.exact.expr import numbers
from rbstab.systems.system import System

FIRST = 0.95
"""The share of what the samples allow that is tried first as the largest load."""

NEAR = 0.01
"""The bisection for the largest load ends at this relative difference."""

LEAST = 0.1
"""Loads that are smaller than this share of what the samples allow are not tried."""

ROUND_OFF = 1e-9
"""A smaller V, as a share of the level, is round-off."""

DIGITS = 4
"""Significant digits of loads that are tried."""

OFF_DESIRED = "the desired attitude is not Θ = 0, from where the tilt is counted"

NO_CANDIDATE = "no V of this form was found that falls up to that tilt if nothing disturbs the body"


def stated_in(config: Config) -> Stated | None:
    """Return the bounds that a config states, as exact decimals; None if it states none."""
    section = config.bound
    if section is None:
        return None
    loads = {"couple": Load("couple"), "force": Load("force", section.point or ZERO)}
    sizes = {loads[kind]: getattr(section, kind) for kind in loads}
    given = {load: as_decimal(size) for load, size in sizes.items() if size is not None}
    return Stated(given, as_decimal(section.tilt))


def forms_for(config: Config, loads: Sequence[Load]) -> Forms:
    """Return V and V' of a config under loads, without its inputs.

    Raises:
        NoFormsError: There are none.
    """
    user = next(iter(of_users(config)), None)
    if user is not None:
        raise NoFormsError(f"{user} is code of a user")
    if config.desired is not None and any(config.desired.orientation):
        raise NoFormsError(OFF_DESIRED)
    return forms_of(without_inputs(system_of(without_code(config), numbers)), loads)


def prove_bound(
    config: Config, given: Mapping[Load, Fraction], tilt: Fraction, *, largest: bool = False
) -> Bound:
    """Prove that loads below bounds keep the tilt of a body below another, for ever.

    Inputs of the config are left out: they are loads too.

    Args:
        config: The config; the result does not depend on its initial state, but for `start`.
        given: The bounds on the magnitudes of loads, N m or N.
        tilt: The bound on the tilt, rad, below π/2.
        largest: Whether to look for the largest loads, and the smallest that break the bound.
    """
    bound = Bound(tuple(given), tuple(given.values()), tilt)
    bound = replace(bound, without_inputs=supplies_power(config))
    try:
        forms = forms_for(config, bound.loads)
    except NoFormsError as error:
        return replace(bound, why=str(error))
    with np.errstate(all="ignore"):
        attempts = _Attempts(bound, forms)
        bound = attempts.of(1.0)
        if bound.claim is not None:
            bound = replace(bound, record=claim_record(Stated(given, tilt), forms, bound.claim))
            bound = with_start(bound, config, forms)
        if largest:
            system = without_inputs(system_of(config))
            bound = replace(bound, largest=attempts.largest(system, given=bound.proved))
    return bound


class _Attempts:
    """Attempts to prove a bound for loads times factors."""

    def __init__(self, bound: Bound, forms: Forms) -> None:
        self.bound, self.forms = bound, forms
        sizes = [float(size) for size in bound.sizes]
        self.samples = Samples(forms, float(bound.tilt), sizes)
        self.candidate = self.samples.candidate()

    def sizes(self, factor: float) -> Sizes:
        """Return the loads times a factor."""
        if factor == 1.0:
            return self.bound.sizes
        return tuple(Fraction(f"{float(size) * factor:.{DIGITS}g}") for size in self.bound.sizes)

    def of(self, factor: float, *, again: bool = True) -> Bound:
        """Return the bound for loads times a factor; where a proof fails is one more sample."""
        most, sizes = self.candidate.factor, self.sizes(factor)
        bound = replace(self.bound, sizes=sizes)
        if most == 0.0:
            return replace(bound, why=NO_CANDIDATE)
        if factor >= most:
            names = names_of(bound.loads, self.sizes(most))
            return replace(bound, why=f"the best V that was found allows a {names}")
        claim = self.candidate.claim(bound.tilt, sizes, factor / most)
        end = prove(self.forms, claim)
        if end.where is not None and again:
            self.samples.add(end.where)
            before, self.candidate = self.candidate, self.samples.candidate()
            if self.candidate != before:
                return self.of(factor, again=False)
        if end.where is not None:
            why = f"{grouped(end.boxes)} boxes leave it open near Θ = {angles(end.where)} rad"
            return replace(bound, why=why, boxes=end.boxes)
        return replace(bound, boxes=end.boxes, claim=claim)

    def largest(self, system: System, *, given: bool) -> Largest:
        """Return the largest loads; `given` says whether those without a factor are proved."""
        low, high, tried = 1.0 if given else 0.0, self.candidate.factor, False
        factor = FIRST * high
        while high - low > NEAR * high and high > LEAST * self.candidate.factor:
            factor = factor if factor > low else 0.5 * (low + high)
            if self.of(factor).proved:
                low = factor
            else:
                high, tried = factor, True
            factor = 0.5 * (low + high)
        sizes = [float(size) for size in self.bound.sizes]
        tilt = float(self.bound.tilt)
        broken = smallest_breaking(system, self.forms.rest, self.bound.loads, sizes, tilt)
        return Largest(
            self.sizes(low) if low else None,
            self.sizes(high) if tried else None,
            None if broken is None else tuple(broken * size for size in sizes),
        )


def with_start(bound: Bound, config: Config, forms: Forms) -> Bound:
    """Return a proved bound with V at the start of a config, and whether it is about this start.

    Args:
        bound: The bound, proved.
        config: The config.
        forms: V and V', for its body.
    """
    problem, claim = problem_of(config), bound.claim
    assert claim is not None
    at_rest = configurations(problem.system).system
    held = at_rest.coordinates.holds_contact
    rest, states_at_rest = at_rest.motion(forms.rest), forms.rest[at_rest.coordinates.size :]
    motion = problem.system.motion(problem.start)
    element_states = problem.start[problem.system.coordinates.size :]
    tied, moving = ([], []) if held else ([motion.E - rest.E], [motion.F])
    z = np.concatenate([[1.0], *tied, element_states - states_at_rest, motion.Omega, *moving])
    V = Matrices([forms.value(claim.cross)]).at(motion.Theta[:, None])[0][..., 0]
    value, level = float(z @ V @ z), float(claim.level)
    if abs(value) < ROUND_OFF * level:
        value = 0.0
    (tilt,) = tilt_of(motion.Theta[np.newaxis], np.zeros(3)).tolist()
    return replace(bound, start=value, is_inside=value < level and tilt < float(claim.tilt))
