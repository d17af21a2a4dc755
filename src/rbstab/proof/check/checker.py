"""Check a record of a proof by other means than those that made it: theorems 1 to 6, 10, 13, 16.

From the record come only the energy, as exact operations, and claims about it. Balls of 128 bits,
Taylor series, covers and floods are made here anew.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import chain
from typing import Any

from flint import ctx

from rbstab.proof.check.confine import confinement
from rbstab.proof.check.convex import parts_of, why_not_convex
from rbstab.proof.check.disturbances import DISTURBANCES, bound_findings
from rbstab.proof.check.energy import Energy, read_energy
from rbstab.proof.check.findings import (
    CONVEXITY,
    EVERYWHERE,
    IN_RANGE,
    TIME,
    Finding,
    RefusedError,
    TooLongError,
    confirmed,
)
from rbstab.proof.check.ranges import Range, range_of
from rbstab.proof.check.regions import kept, region_findings
from rbstab.proof.check.states import Listed
from rbstab.proof.check.switches import why_not_smooth

FORMAT = 1
PRECISION = 128
"""Bits of a ball."""


def check(
    record: Mapping[str, Any], progress: Callable[[Finding], None] = lambda _: None
) -> list[Finding]:
    """Check all claims of a record.

    Args:
        record: The record, as plain data; its form is described in `rbstab.proof.record`.
        progress: Called with each finding as soon as it is made.

    Returns:
        The findings. The proof is verified if all of them are.
    """
    findings, first = list[Finding](), DISTURBANCES if "bound" in record else IN_RANGE
    with ctx.workprec(PRECISION):
        try:
            for finding in _findings(record):
                findings.append(finding)
                progress(finding)
        except TooLongError as error:
            about = findings[-1].about if findings else first
            findings.append(Finding(about, TIME, False, f"{error}."))
        except RefusedError as error:
            findings.append(Finding(first, "record", False, f"{error}."))
        except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
            text = f"The record cannot be read: {type(error).__name__}: {error}."
            findings.append(Finding(first, "record", False, text))
    return findings


def _findings(record: Mapping[str, Any]) -> Iterator[Finding]:
    if record["format"] != FORMAT:
        raise RefusedError("the record has another format")
    if "bound" in record:
        yield from bound_findings(record["bound"])
        return
    energy = record["energy"]
    U = read_energy(energy["operations"], energy["free"])
    about = list[tuple[str, str, str | None]]()
    if U.free:
        but = ", but for its springs" if parts_of(U).lines else ""
        text = f"U is convex in the variables besides Θ{but}."
        about.append((CONVEXITY, text, why_not_convex(U)))
    if any(operation[0] == "step" for operation in U.operations):
        text = "U is as smooth at each switch as it is said to be."
        about.append(("switches", text, why_not_smooth(U)))
    for claim, text, why in about:
        yield Finding(IN_RANGE, claim, why is None, text if why is None else f"{why}.")
        if why is not None:
            return
    if not record["ranges"]:
        raise RefusedError("the record claims nothing")
    for claims in record["ranges"]:
        yield from _of_range(U, energy, claims)


def _of_range(U: Energy, energy: Mapping[str, Any], claims: Mapping[str, Any]) -> Iterator[Finding]:
    """Check the claims on one range; the first one that is not verified ends it."""
    range_, about_ends = range_of(U, energy, claims)
    listed, findings = Listed(U, claims, range_), list[Finding]()
    ends = (confinement(U, whole) for whole in [range_] if whole.name == EVERYWHERE)
    keeps = (kept(U, range_, float(level)) for level in [claims.get("kept")] if level is not None)
    for finding in chain(about_ends, ends, keeps, listed.findings()):
        findings.append(finding)
        yield finding
        if not finding.verified:
            break
    else:
        for finding in region_findings(listed, claims):
            findings.append(finding)
            yield finding
    if claims.get("every_start"):
        yield _every_start(U, range_, claims, findings)


def _every_start(
    U: Energy, range_: Range, claims: Mapping[str, Any], findings: Sequence[Finding]
) -> Finding:
    """Check theorem 10: barriers or a stop close the range, with one rest state, a minimum."""
    wide = range_.name == EVERYWHERE
    single = claims["complete"] is True and [state["index"] for state in claims["states"]] == [0]
    # On its way a spring may lose its length.
    single = single and not (U.free and parts_of(U).lines)
    closed = 1 in range_.closed and (wide or {0, 2} <= range_.closed)
    verified = single and closed and all(finding.verified for finding in findings)
    inside = "within the stop" if range_.stop is not None else "with |θ2| < π/2"
    inside = inside if wide else "in the range of eq. 5"
    text = f"Every motion that starts {inside} converges to the rest state"
    return confirmed(range_.name, "every start", text, {}, verified=verified)
