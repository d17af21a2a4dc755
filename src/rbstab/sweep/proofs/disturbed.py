"""Which members stay near rest for ever, by the proved bound of their body on disturbances."""

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from time import monotonic
from typing import NamedTuple

import numpy as np

from rbstab.analysis.bounded import Bounded, bounded_decimal, bounded_decimals
from rbstab.analysis.configuration import without_inputs
from rbstab.config.build import system_of
from rbstab.config.schema import Config
from rbstab.experiment.disturbed.bound import Bound
from rbstab.experiment.disturbed.prove_bound import stated_in
from rbstab.experiment.disturbed.stored import bound_for, kept_bound
from rbstab.mechanics.attitude import half_sine_squared
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import X_OF_Z
from rbstab.proof.boxes import Boxes
from rbstab.proof.disturbed.forms import forms_of
from rbstab.proof.disturbed.matrices import Matrices
from rbstab.proof.disturbed.record import Stated
from rbstab.proof.exact.expr import numbers
from rbstab.store.table import Column
from rbstab.sweep.plan.axes import VariedKey
from rbstab.sweep.plan.plan import Plan
from rbstab.sweep.proofs import prove_bodies
from rbstab.sweep.proofs.bodies import body_keys, distinct_bodies, values_at_start
from rbstab.sweep.proofs.loads import Disturbances, disturbances, is_of_input
from rbstab.sweep.proofs.starts import BATCH_SIZE, as_bounded, bounded_start, column_of

WORDS = ("proved", "larger load", "other load", "start outside", "not decided", "no proof")
"""The values of the column `stated_bound`, in the order of their codes."""

PROVED, LARGER, OTHER, ELSEWHERE, NOT_DECIDED, NO_PROOF = range(6)
"""What the bound says of a member: that it stays below the tilt; or why it says nothing. LARGER
ones start where it holds."""


COLUMN = Column((), "i1", "1", "whether it stays below the stated tilt for ever, or why not", WORDS)
"""The column of a sweep whose base states a bound; no file has it."""


class MemberBounds(NamedTuple):
    """What the bound that a plan states says of its m members.

    Attributes:
        stated: The bound.
        bodies: The distinct bodies, without their inputs: what is proved of each, None if it was
            not tried; and its members.
        loads: The disturbances of the members.
        codes: The answer for each member, shape (m,).
    """

    stated: Stated
    bodies: list[tuple[Bound | None, Array]]
    loads: Disturbances
    codes: Array


def stated_of(plan: Plan) -> Stated | None:
    """Return the bound that the base of a plan states, for all its variants; None if none."""
    return stated_in(next(iter(plan.bases.values())))


def _bodies(plan: Plan) -> Iterator[tuple[Config, Array]]:
    """Yield the config of the first member of each body, and its members; inputs are no part."""
    keys_of_variants = {
        name: tuple(k for k in body_keys(plan, name) if not is_of_input(base, k.path))
        for name, base in plan.bases.items()
    }
    bodies = distinct_bodies(plan, keys_of_variants)
    for body in bodies.order.tolist():
        yield plan.config_of(int(bodies.first[body])), bodies.members(body)


def keep_bounds(plan: Plan, results: Path, *, unlimited: bool = False) -> None:
    """Prove the bound that a plan states for each distinct body, and keep the proofs.

    Args:
        plan: The plan; without a bound nothing is done.
        results: The folder of results.
        unlimited: Whether further proofs begin after the budget of time for those of bodies.

    Raises:
        StoreError: A proof cannot be written.
    """
    if stated_of(plan) is None:
        return
    end = math.inf if unlimited else monotonic() + prove_bodies.BUDGET
    for config, _ in _bodies(plan):
        bound_for(results, config)
        if monotonic() > end:
            return


def member_bounds(plan: Plan, results: Path) -> MemberBounds | None:
    """Return what the stored proofs of a stated bound say of the members; None if none is stated.

    Args:
        plan: The plan.
        results: The folder of results, which keeps the proofs.
    """
    stated = stated_of(plan)
    if stated is None:
        return None
    loads, bodies = disturbances(plan, stated), []
    codes = np.select([loads.other, ~loads.below], [OTHER, LARGER], PROVED)
    for config, members in _bodies(plan):
        bound = kept_bound(results, config)
        bodies.append((bound, members))
        if bound is None or bound.claim is None:
            codes[members] = NO_PROOF if bound is None else NOT_DECIDED
            continue
        for part in np.array_split(members, 1 + len(members) // BATCH_SIZE):
            inside = starts_within(config, *values_at_start(plan, part), bound)
            codes[part[~inside & (codes[part] != OTHER)]] = ELSEWHERE
    return MemberBounds(stated, bodies, loads, codes)


@np.errstate(all="ignore")  # what has no bound is not within
def starts_within(
    base: Config, varied_keys: tuple[VariedKey, ...], values: Mapping[str, Array], bound: Bound
) -> Array:
    """Return which starts a proved bound is about: V < ℓ and a tilt below ρ, rigorously.

    Args:
        base: The base of the members.
        varied_keys: The varied keys, all of them keys of the initial state.
        values: Their values, each of shape (members,).
        bound: The bound.

    Returns:
        Shape (members,); (1,) if no key varies.
    """
    claim = bound.claim
    assert claim is not None
    forms = forms_of(without_inputs(system_of(base, numbers)), bound.loads)
    system = system_of(base, bounded_decimals)
    motion, element_states = bounded_start(base, varied_keys, values, system)
    rest, held = bounded_decimals(forms.rest), system.coordinates.holds_contact
    place = [] if held else [motion.E - rest[X_OF_Z] + system.anchor]
    speed = [motion.Omega] if held else [motion.Omega, motion.F]
    z = np.concatenate(
        [[1.0], *place, element_states - rest[len(rest) - len(element_states) :], *speed]
    )
    count, angles = max(map(len, values.values()), default=1), map(as_bounded, motion.Theta)
    ends = [(column_of(a.low, count), column_of(a.high, count)) for a in angles]
    (over,) = Matrices([forms.value(claim.cross)]).over(Boxes(*np.stack(ends, axis=1)))
    M = Bounded(over.middle, np.abs(over.slopes).sum(axis=0) + over.error)
    pairs = np.ndindex(len(z), len(z))
    V = sum(Bounded(M.value[k], M.error[k]) * (z[k[0]] * z[k[1]]) for k in pairs)
    half = bounded_decimal(0.5 * float(claim.tilt)).sin()
    upright = as_bounded(half_sine_squared(motion.A)).high < (half * half).low
    return np.asarray(upright & (V.high < bounded_decimal(float(claim.level)).low))
