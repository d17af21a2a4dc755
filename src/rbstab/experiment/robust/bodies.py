"""Proofs for all bodies, gravities and controllers within tolerances of a config."""

import time
from collections.abc import Callable, Iterable, Sequence
from fractions import Fraction
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from rbstab.analysis.exact import decimals
from rbstab.analysis.fingerprint import fingerprint
from rbstab.config.build import system_of
from rbstab.config.load import acting_sections
from rbstab.config.numbers import replaced
from rbstab.config.schema import Config
from rbstab.config.tolerances import Tolerance, decimal_text
from rbstab.config.user_code.permission import has_code, without_code
from rbstab.experiment.answers.reasons import NOT_DAMPED
from rbstab.experiment.robust.record import (
    BodiesRecord,
    StoredTolerance,
    bounds_of,
    digest_of,
)
from rbstab.experiment.stored_proof.proof import SUPPLIES
from rbstab.mechanics.numbers import Array
from rbstab.systems.system import System

if TYPE_CHECKING:
    from rbstab.proof.robust.numbers import Members

BODIES_VERSION = 2
"""To be increased when a change of the method changes its results; older proofs are then redone."""

CODE_VARIES = (
    "beside code of a user, its numbers, the contact point and the anchor have no tolerances"
)

UNUSUAL_CODE = "code of a user has more than 6 switches, a stop of its own, or depends on the time"

NOT_DECIDED = "not decided"
"""The outcome of a proof whose hypotheses do not hold for each body."""


def bodies_id(config: Config, tolerances: Iterable[StoredTolerance]) -> str:
    """Return the identity of a proof: a digest of the config, its tolerances, and the equations."""
    bounds = sorted((one.key, one.low, one.high) for one in tolerances)
    equations = fingerprint(partial(system_of, without_code(config)))
    return digest_of("bodies", BODIES_VERSION, acting_sections(config), bounds, equations)


def prove_within(
    config: Config,
    tolerances: Sequence[Tolerance],
    part_limit: int | None = None,
    is_late: Callable[[], bool] = lambda: False,
) -> BodiesRecord:
    """Prove for all bodies within tolerances that they have one rest state, and bound their level.

    Args:
        config: The config; its initial state and its integration have no effect.
        tolerances: Tolerances of body, gravity and controller.
        part_limit: The number of parts of the box that are examined at most; default 32.
        is_late: Returns whether no further part is to be examined.
    """
    # Imported late: a stored proof is usually read, and none is made.
    from rbstab.proof.robust.bodies import PART_LIMIT, BodiesOutcome, prove_bodies
    from rbstab.proof.robust.numbers import Part

    start, bounds = time.perf_counter(), bounds_of(tolerances)
    facts: dict[str, Any] = {
        "id": bodies_id(config, bounds),
        "version": BODIES_VERSION,
        "sections": acting_sections(config),
        "tolerances": bounds,
    }
    why = _unknown_code(config, tolerances) or _undamped(config, tolerances)
    if why is not None:
        return BodiesRecord(
            outcome=NOT_DECIDED,
            proved=None,
            level=0.0,
            parts=0,
            boxes=0,
            why=why,
            seconds=time.perf_counter() - start,
            **facts,
        )
    box = Part(tuple(one.middle for one in tolerances), tuple(one.radius for one in tolerances))
    with np.errstate(all="ignore"):
        limit = PART_LIMIT if part_limit is None else part_limit
        proof = prove_bodies(members_of(config, tolerances), box, limit, is_late)
    if proof.false is not None:
        pairs = zip(tolerances, proof.false.numbers, strict=True)
        facts["body"] = {one.entry.key: decimal_text(number) for one, number in pairs}
        facts["rest_states"] = proof.false.rest_states.tolist()
    proved = {BodiesOutcome.PROVED: True, BodiesOutcome.SEVERAL: False}
    proved[BodiesOutcome.NO_MINIMUM] = False
    fewer = proof.outcome is BodiesOutcome.PART_LIMIT and limit < PART_LIMIT
    limited = fewer or proof.outcome is BodiesOutcome.TIME_LIMIT
    return BodiesRecord(
        outcome=proof.outcome.value,
        proved=proved.get(proof.outcome),
        level=float(proof.level),
        parts=proof.parts,
        boxes=proof.boxes,
        why=proof.reason,
        seconds=time.perf_counter() - start,
        widest=None if proof.axis is None else tolerances[proof.axis].entry.key,
        brief=True if limited else None,
        **facts,
    )


def _unknown_code(config: Config, tolerances: Sequence[Tolerance]) -> str | None:
    """Return why code of users is not shown to be passive for each body; None if it is, or none is.

    It is shown for the body in the middle (`why_not_in_proofs`); mass, inertia, gravity and the
    gains of other elements do not enter its statements.
    """
    if not has_code(config):
        return None
    from rbstab.proof.passive.passive import in_proofs, why_not_in_proofs

    system = system_of(config)
    users = [element for element in system.elements if element.from_user]
    fixed = [("body", "contact_point"), *(("elements", element.name) for element in users)]
    paths = [path for one in tolerances for path in one.entry.paths]
    moved = any(path[: len(start)] == start for path in paths for start in fixed)
    if moved or getattr(config.controller, "anchor", "origin") == "equilibrium":
        return CODE_VARIES
    if not all(in_proofs(element) for element in users):
        return UNUSUAL_CODE
    return why_not_in_proofs(system)


def _undamped(config: Config, tolerances: Sequence[Tolerance]) -> str | None:
    """Return why it is not known that each body loses energy in each motion; None if it is."""
    from rbstab.proof.passive.damping import indefinite_parameter, why_not_damped
    from rbstab.proof.robust.definite import lowest_systems

    if system_of(config).supplies:
        return SUPPLIES
    for system in lowest_systems(partial(_corner, config, tolerances)):
        indefinite = indefinite_parameter(system)
        if indefinite is not None:
            return f"{indefinite} is not positive definite for each body"
        # The points of the body may have tolerances.
        undamped = why_not_damped(system, points_vary=True)
        if undamped is not None:
            return f"{NOT_DAMPED}: {undamped}"
    return None


def members_of(config: Config, tolerances: Sequence[Tolerance]) -> "Members":
    """Return the functions that build the system of a member."""
    from rbstab.proof.robust.numbers import Members

    def changed(base: Config, numbers: Sequence[Any]) -> Config:
        pairs = zip(tolerances, numbers, strict=True)
        return replaced(base, {path: number for one, number in pairs for path in one.entry.paths})

    known = without_code(config)
    return Members(
        lambda numbers, convert: system_of(changed(known, numbers), convert),
        lambda numbers: system_of(changed(config, numbers)),
    )


def _corner(config: Config, tolerances: Sequence[Tolerance], signs: tuple[int, int, int]) -> System:
    """Return the system at one corner of the tolerances, in rational numbers."""
    from rbstab.proof.robust.definite import bound_at

    numbers = [bound_at(one.entry.paths[0], one.low, one.high, signs) for one in tolerances]
    return members_of(config, tolerances).exact(numbers, _rational)


def _rational(numbers: Array) -> Array:
    """Convert the doubles of an array to the decimals that they mean; leave fractions."""
    entries = np.empty(numbers.shape, dtype=object)
    for index in np.ndindex(numbers.shape):
        entry: Any = numbers[index]
        exact = isinstance(entry, Fraction)
        entries[index] = entry if exact else decimals(np.array(float(entry)))[()]
    return entries
