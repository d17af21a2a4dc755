"""The options --bound and --within-tilt of `rbstab stability`."""

import math
from collections.abc import Sequence
from contextlib import suppress
from fractions import Fraction
from typing import NamedTuple

import click

from rbstab.config.schema import Config
from rbstab.experiment.disturbed.bound import UNITS, Bound
from rbstab.experiment.disturbed.prove_bound import prove_bound
from rbstab.proof.disturbed.forms import Load
from rbstab_cli.output.progress import working

LEAST, MOST = 1e-9, 1e9


class Asked(NamedTuple):
    """What --bound and its options ask: bounds on loads, one on the tilt, rad, and the largest."""

    given: dict[Load, Fraction]
    tilt: Fraction
    largest: bool


def asked_bound(texts: Sequence[str], tilt: str | None, *, largest: bool) -> Asked | None:
    """Return what is asked, before anything is computed; None if nothing is.

    Args:
        texts: The values of --bound: KIND=SIZE.
        tilt: The value of --within-tilt, rad; None without it.
        largest: Whether --largest is given.

    Raises:
        UsageError: A text has another form, or a kind of load is given twice.
    """
    if not texts or tilt is None:
        return None
    angle = _number(tilt)
    if angle is None or not 0 < angle < math.pi / 2:
        raise click.UsageError(
            f"--within-tilt {tilt}: expected an angle above 0 and below π/2 = 1.5707, rad"
        )
    given = dict(map(_load, texts))
    if len({load.kind for load in given}) < len(texts):
        raise click.UsageError("--bound: expected at most one couple and one force")
    return Asked(given, angle, largest)


def _load(text: str) -> tuple[Load, Fraction]:
    """Return the load and its bound in KIND=SIZE or force=SIZE@X,Y,Z."""
    kind, _, rest = text.partition("=")
    size, at, point = rest.partition("@")
    bound = _number(size)
    places = tuple(map(_number, point.split(","))) if at else (Fraction(0),) * 3
    is_valid = kind in UNITS and not (at and kind == "couple")
    if not is_valid or bound is None or float(bound) < LEAST or len(places) != 3 or None in places:
        raise click.UsageError(
            f"--bound {text}: expected couple=N m or force=N, from {LEAST:g} to {MOST:g}, such as "
            "couple=100; a force acts at the centre of gravity, or at a point of the body, m: "
            "force=50@0.1,0,0.4"
        )
    return Load(kind, tuple(float(place or 0) for place in places)), bound


def _number(text: str) -> Fraction | None:
    """Return a decimal number exactly; None if it is none, or too large."""
    with suppress(ValueError, OverflowError):
        if abs(float(text)) <= MOST and "_" not in text:
            return Fraction(text.strip())
    return None


def proved_bound(name: str, config: Config, asked: Asked) -> Bound:
    """Prove what is asked of one config.

    Args:
        name: The name of the config, for the progress.
        config: The config.
        asked: What is asked, from `asked_bound`.
    """
    with working(f"{name}: all disturbances"):
        return prove_bound(config, asked.given, asked.tilt, largest=asked.largest)
