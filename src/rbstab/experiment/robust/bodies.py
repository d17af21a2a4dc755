"""Proofs for all bodies, gravities and controllers within tolerances of a config."""

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from fractions import Fraction
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rbstab.analysis.exact import decimals
from rbstab.config.build import system_of
from rbstab.config.load import acting_sections
from rbstab.config.numbers import replaced
from rbstab.config.schema import Config
from rbstab.config.source import Path as KeyPath
from rbstab.config.tolerances import Tolerance, decimal_text
from rbstab.config.user_code.permission import has_code, without_code
from rbstab.elements.motors import Hard, Lagged
from rbstab.experiment.answers.reasons import NOT_DAMPED
from rbstab.experiment.proof_cache import NO_FILE_ERRORS, PROOFS
from rbstab.experiment.robust.record import BodiesRecord, StoredTolerance, bounds_of
from rbstab.experiment.stored_proof.data import SUPPLIES
from rbstab.experiment.stored_proof.identity import digest_of, equations_of
from rbstab.store.errors import StoreError

if TYPE_CHECKING:
    from rbstab.proof.robust.numbers import Members

BODIES_VERSION = 3
"""To be increased when a change of the method changes its results; older proofs are then redone."""

CODE_VARIES = (
    "beside code of a user, its numbers, the contact point and the anchor have no tolerances"
)

UNUSUAL_CODE = "code of a user has more than 6 switches, a stop of its own, or depends on the time"


def bodies_id(config: Config, tolerances: Iterable[StoredTolerance]) -> str:
    """Return the identity of a proof: a digest of the config, its tolerances, and the equations."""
    bounds = sorted((tolerance.key, tolerance.low, tolerance.high) for tolerance in tolerances)
    parts = ("bodies", BODIES_VERSION, acting_sections(config), bounds, equations_of(config))
    return digest_of(parts)


def bodies_for(
    folder: Path,
    config: Config,
    tolerances: Sequence[Tolerance],
    is_late: Callable[[], bool] = lambda: False,
    part_limit: int | None = None,
) -> BodiesRecord:
    """Return the stored proof for tolerances of a config; if there is none, make and store it.

    A brief one that decided nothing is made again, unless it examined as many parts as are allowed.

    Args:
        folder: The folder of results.
        config: The config.
        tolerances: Tolerances of body, gravity and controller.
        is_late: As for `prove_within`.
        part_limit: As for `prove_within`.

    Raises:
        StoreError: The proof cannot be written, or the disk fails to read it.
    """
    record = BodiesRecord.kept(folder, bodies_id(config, bounds_of(tolerances)))
    if record is None or (record.brief and not (part_limit and record.parts >= part_limit)):
        record = prove_within(config, tolerances, part_limit, is_late)
        record.keep(folder)
    return record


def all_bodies(folder: Path) -> list[BodiesRecord]:
    """Return all stored proofs for bodies within tolerances, in the order of their names.

    Damaged files are left out.

    Raises:
        StoreError: The disk reports an error.
    """
    try:
        names = sorted(path.name for path in (folder / PROOFS).iterdir())
    except OSError as error:
        if error.errno in NO_FILE_ERRORS:
            return []  # as a single proof there
        raise StoreError(f"{folder} cannot be read: {error.strerror or error}") from error
    prefix, end = BodiesRecord.PREFIX, ".json"
    ids = [name[len(prefix) : -len(end)] for name in names if name.startswith(prefix)]
    records = [BodiesRecord.kept(folder, identity) for identity in ids]
    return [record for record in records if record is not None]


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
    from rbstab.proof.robust.bodies import PART_LIMIT, BodiesOutcome, BodiesProof, prove_bodies
    from rbstab.proof.robust.numbers import Part

    start, bounds = time.perf_counter(), bounds_of(tolerances)
    limit = PART_LIMIT if part_limit is None else part_limit
    why = why_not_all(config, tolerances)
    if why:
        proof = BodiesProof(BodiesOutcome.NOT_PASSIVE, reason=why)
    else:
        box = Part(
            tuple(tolerance.middle for tolerance in tolerances),
            tuple(tolerance.radius for tolerance in tolerances),
        )
        with np.errstate(all="ignore"):
            proof = prove_bodies(members_of(config, tolerances), box, limit, is_late)
    fewer = proof.outcome is BodiesOutcome.PART_LIMIT and limit < PART_LIMIT
    keys = [tolerance.entry.key for tolerance in tolerances]
    false = proof.false
    return BodiesRecord(
        id=bodies_id(config, bounds),
        version=BODIES_VERSION,
        sections=acting_sections(config),
        tolerances=bounds,
        outcome=proof.outcome.value,
        proved=proof.proved,
        level=float(proof.level),
        parts=proof.parts,
        boxes=proof.boxes,
        why=proof.reason,
        widest=None if proof.axis is None else keys[proof.axis],
        brief=True if fewer or proof.outcome is BodiesOutcome.TIME_LIMIT else None,
        body=None
        if false is None
        else dict(zip(keys, map(decimal_text, false.numbers), strict=True)),
        rest_states=() if false is None else false.rest_states.tolist(),
        seconds=time.perf_counter() - start,
    )


MOTORS = (
    "no proof within tolerances, or along a parameter, takes motors with a lag, or a hard limit, "
    "into account"
)


def why_not_all(config: Config, tolerances: Sequence[Tolerance]) -> str:
    """Return why it is not known that each body loses energy in each motion; empty if it is."""
    from rbstab.proof.passive.damping import indefinite_parameter, why_not_damped
    from rbstab.proof.passive.passive import in_proofs, why_not_in_proofs

    system = system_of(config)
    if has_code(config):
        # It is shown of code of users for the body in the middle. Mass, inertia, gravity and the
        # gains of other elements do not enter its statements.
        users = [element for element in system.elements if element.from_user]
        fixed = [("body", "contact_point"), *(("elements", element.name) for element in users)]
        paths = [path for tolerance in tolerances for path in tolerance.entry.paths]
        moved = any(path[: len(start)] == start for path in paths for start in fixed)
        if moved or getattr(config.controller, "anchor", "origin") == "equilibrium":
            return CODE_VARIES
        why = why_not_in_proofs(system) if all(map(in_proofs, users)) else UNUSUAL_CODE
        if why is not None:
            return why
    if system.supplies or any(isinstance(element, (Hard, Lagged)) for element in system.elements):
        return SUPPLIES if system.supplies else MOTORS
    members = members_of(config, tolerances)
    for numbers in lowest_numbers(tolerances):
        lowest = members.exact(numbers, decimals)
        indefinite = indefinite_parameter(lowest)
        if indefinite is not None:
            return f"{indefinite} is not positive definite for each body"
        # The points of the body may have tolerances.
        undamped = why_not_damped(lowest, points_vary=True)
        if undamped is not None:
            return f"{NOT_DAMPED}: {undamped}"
    return ""


def lowest_numbers(tolerances: Sequence[Tolerance]) -> Iterator[list[Fraction]]:
    """Yield the numbers of the bodies that decide what is definite for all bodies in a box.

    x'Mx is linear in each entry of a symmetric matrix M, and grows with its diagonal. So M, or a
    sum of such matrices, is positive (semi)definite for all bodies if it is so with the lowest
    diagonal and each of the eight choices of low or high entries (1, 2), (1, 3) and (2, 3).
    """
    for high in product((False, True), repeat=3):
        beside: dict[KeyPath, bool] = {(0, 1): high[0], (0, 2): high[1], (1, 2): high[2]}
        yield [
            tolerance.high if beside.get(tolerance.entry.paths[0][-2:]) else tolerance.low
            for tolerance in tolerances
        ]


def members_of(config: Config, tolerances: Sequence[Tolerance]) -> "Members":
    """Return the functions that build the system of a member."""
    from rbstab.proof.robust.numbers import Members

    def changed(base: Config, numbers: Sequence[Any]) -> Config:
        pairs = zip(tolerances, numbers, strict=True)
        return replaced(
            base, {path: number for tolerance, number in pairs for path in tolerance.entry.paths}
        )

    plain = without_code(config)
    return Members(
        lambda numbers, convert: system_of(changed(plain, numbers), convert),
        lambda numbers: system_of(changed(config, numbers)),
    )
