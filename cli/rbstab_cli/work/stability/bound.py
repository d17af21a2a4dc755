"""The options --bound and --within-tilt of `rbstab stability`, and the section `bound`."""

import math
from collections.abc import Iterable, Sequence
from contextlib import suppress
from fractions import Fraction
from pathlib import Path

import click

from rbstab.config.schema import Config
from rbstab.config.sections.bound import LEAST, MOST
from rbstab.experiment.disturbed.bound import UNITS, Bound
from rbstab.experiment.disturbed.prove_bound import prove_bound, stated_in
from rbstab.experiment.disturbed.stored import bound_for
from rbstab.proof.disturbed.forms import Load
from rbstab.proof.disturbed.record import Stated
from rbstab.store.errors import StoreError
from rbstab_cli.output.progress import working
from rbstab_cli.printing import say


def asked_bound(
    configs: Iterable[Config], texts: Sequence[str], tilt: str | None, *, largest: bool
) -> Stated | None:
    """Return what the options ask, before anything is computed; None if nothing is.

    Args:
        configs: The configs, which may state bounds themselves.
        texts: The values of --bound: KIND=SIZE.
        tilt: The value of --within-tilt, rad; None without it.
        largest: Whether --largest is given.

    Raises:
        UsageError: A text has another form, or a kind of load is given twice.
    """
    if largest and not texts and all(config.bound is None for config in configs):
        raise click.UsageError("--largest has no effect without --bound, or bound in a config")
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
    return Stated(given, angle)


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


def proved_bound(
    name: str, config: Config, asked: Stated | None, results: Path, *, largest: bool
) -> Bound | None:
    """Prove what is asked of one config, or else what it states; None if it is nothing."""
    asked = asked or stated_in(config)
    if asked is None:
        return None
    with working(f"{name}: all disturbances"):
        if not largest:
            try:
                return bound_for(results, config, asked)
            except StoreError as error:
                say(f"warning: {error}; the proof is not stored")
        return prove_bound(config, asked.given, asked.tilt, largest=largest)
