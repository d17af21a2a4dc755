"""Check a record of a proof by other means than those that made it: theorems 1, 3, 5, 6, 10 and 13.

From the record come only the energy, as exact operations, and claims about it. Balls of 128 bits,
Taylor series, covers and floods are made here anew.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from flint import ctx

from rbstab.proof.check.confine import confined
from rbstab.proof.check.energy import Energy
from rbstab.proof.check.findings import (
    EVERYWHERE,
    IN_RANGE,
    TIME,
    Finding,
    RefusedError,
    TooLongError,
)
from rbstab.proof.check.least import why_not_convex
from rbstab.proof.check.listed import Listed
from rbstab.proof.check.ranges import Range, range_of
from rbstab.proof.check.regions import Region, regions
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
    findings = list[Finding]()
    with ctx.workprec(PRECISION):
        try:
            for finding in _findings(record):
                findings.append(finding)
                progress(finding)
        except TooLongError as error:
            about = findings[-1].about if findings else IN_RANGE
            findings.append(Finding(about, TIME, False, f"{error}."))
        except RefusedError as error:
            findings.append(Finding(IN_RANGE, "record", False, f"{error}."))
        except (
            AttributeError,
            IndexError,
            KeyError,
            OverflowError,
            TypeError,
            ValueError,
        ) as error:
            text = f"The record cannot be read: {type(error).__name__}: {error}."
            findings.append(Finding(IN_RANGE, "record", False, text))
    return findings


def _findings(record: Mapping[str, Any]) -> Iterator[Finding]:
    if record["format"] != FORMAT:
        raise RefusedError("the record has another format")
    energy = record["energy"]
    U = Energy(energy["operations"], _variables(energy["free"]))
    if U.free:
        why = why_not_convex(U)
        but = ", but for its springs" if why is None and U.springs.lines else ""
        text = f"U is convex in the variables besides Θ{but}."
        yield Finding(IN_RANGE, "convexity", why is None, text if why is None else f"{why}.")
        if why is not None:
            return
    if U.steps:
        why = why_not_smooth(U)
        text = "U is as smooth at each switch as it is said to be."
        yield Finding(IN_RANGE, "switches", why is None, text if why is None else f"{why}.")
        if why is not None:
            return
    if not record["ranges"]:
        raise RefusedError("the record claims nothing")
    for claims in record["ranges"]:
        yield from _of_range(U, energy, claims)


def _variables(free: Any) -> tuple[int, ...]:
    if not all(type(k) is int and k > 2 for k in free) or len(set(free)) < len(free):
        raise RefusedError("the variables besides Θ are not numbered")
    return (0, 1, 2, *free)


def _of_range(U: Energy, energy: Mapping[str, Any], claims: Mapping[str, Any]) -> Iterator[Finding]:
    """Check the claims on one range; the first one that is not verified ends it."""
    found = list[Finding]()
    range_, about_ends = range_of(U, energy, claims)
    for finding in _in_order(U, range_, claims, about_ends):
        found.append(finding)
        yield finding
    if claims.get("every_start"):
        springs = bool(U.free) and bool(U.springs.lines)
        yield _every_start(range_, claims, found, has_springs=springs)


def _in_order(
    U: Energy, range_: Range, claims: Mapping[str, Any], about_ends: Sequence[Finding]
) -> Iterator[Finding]:
    yield from about_ends
    if not all(one.verified for one in about_ends):
        return
    if range_.name == EVERYWHERE:
        ends = confinement(U, range_)
        yield ends
        if not ends.verified:
            return
    listed = Listed(U, claims, range_)
    for finding in listed.findings():
        yield finding
        if not finding.verified:
            return
    for everywhere, state, level in regions(listed, claims):
        name = "certified region" if everywhere else f"region of {state.name}"
        if state.index != 0:
            text = f"R{state.name[1:]} is not proved to be a minimum."
            yield Finding(range_.name, name, False, text)
            continue
        region = Region(listed, state, level)
        yield region.everywhere() if everywhere else region.component()


def confinement(U: Energy, range_: Range) -> Finding:
    """Check by theorem 6 that no rest state is beyond the ends of θ1 and θ3."""
    cover = confined(U, range_)
    first, third = (float(range_.ends[i].mid()) for i in (0, 2))
    verified = cover is not None and cover.open is None
    text = f"All of them have |θ1| < {first:.5g} and |θ3| < {third:.5g} rad"
    text = f"{text}." if verified else f"{text}: this could not be confirmed."
    covers = {} if cover is None else {"one period": cover}
    return Finding(range_.name, "ends", verified, text, covers)


def _every_start(
    range_: Range, claims: Mapping[str, Any], found: Sequence[Finding], *, has_springs: bool
) -> Finding:
    """Check theorem 10: barriers or a stop close the range, with one rest state, a minimum."""
    wide = range_.name == EVERYWHERE
    single = claims["complete"] is True and [one["index"] for one in claims["states"]] == [0]
    single = single and "no other rest state" in {one.claim for one in found}
    # On its way a spring may lose its length.
    single = single and not has_springs
    closed = 1 in range_.closed and (wide or {0, 2} <= range_.closed)
    verified = single and closed and all(one.verified for one in found)
    inside = "within the stop" if range_.stop is not None else "with |θ2| < π/2"
    inside = inside if wide else "in the range of eq. 5"
    text = f"Every motion that starts {inside} converges to the rest state"
    text = f"{text}." if verified else f"{text}: this could not be confirmed."
    return Finding(range_.name, "every start", verified, text)
