"""Sentences on what is proved for all bodies within tolerances."""

from collections.abc import Sequence
from fractions import Fraction

from rbstab.config.tolerances import decimal_text
from rbstab.experiment.answers.rounded import rounded_down
from rbstab.experiment.answers.state_words import angles
from rbstab.experiment.robust.largest import Largest
from rbstab.experiment.robust.record import BodiesRecord
from rbstab.files.text import grouped


def within_sentences(texts: Sequence[str], record: BodiesRecord) -> list[str]:
    """Return sentences on a proof, the answer first.

    Args:
        texts: The tolerances as given: `controller=±20%`.
        record: The proof.
    """
    return sentences_of(f"For every body within {tolerance_names(texts)}", record)


def sentences_of(bodies: str, record: BodiesRecord) -> list[str]:
    """Return sentences on a proof for all bodies of a box, the answer first.

    Args:
        bodies: The bodies: `For every body within controller ±20 %`.
        record: The proof.
    """
    parts = f"{_count(record.parts, 'part')}, " if record.parts != 1 else ""
    effort = f"{parts}{_count(record.boxes, 'box', 'boxes')}"
    if record.proved is None:
        return [f"{bodies}: not decided{_why_undecided(record)} [{effort}]."]
    if not record.proved:
        claim = "one rest state" if len(record.rest_states) > 1 else "one rest state, a minimum"
        body = f"A body in the box {_resting(record)}: {_changed_numbers(record)}"
        return [f"{bodies}: {claim}: false, proved. {body}."]
    level = "no level of v is proved"
    if record.level > 0:
        level = f"every motion with v(0) < {rounded_down(record.level)} J converges, proved"
    return [
        f"{bodies}: one rest state, a minimum, proved ({effort}). Every motion that stays in the "
        f"range of eq. 5, and keeps a distance from θ2 = ±π/2, converges to it.",
        f"{bodies}: {level}.",
    ]


def named_body(record: BodiesRecord) -> str:
    """Return a sentence on the body of a counterexample, with all its numbers.

    They are written as in a config: `controller.K_r = [80, 80, 64]`.
    """
    left = dict(record.body or {})
    numbers = []
    while left:
        key = next(iter(left))
        name = key.removesuffix("[0]")
        axes = [f"{name}[{axis}]" for axis in range(3)]
        if left.keys() >= {*axes}:
            numbers.append(f"{name} = [{', '.join(left.pop(axis) for axis in axes)}]")
        else:
            numbers.append(f"{key} = {left.pop(key)}")
    return f"The body with {', '.join(numbers)} {_resting(record)}"


def _resting(record: BodiesRecord) -> str:
    """Return where the body of a counterexample rests, as the end of a sentence."""
    several = len(record.rest_states) > 1
    what = "can rest at" if several else "has a rest state that is no minimum,"
    return f"{what} Θ = {' and '.join(map(angles, record.rest_states))} rad"


def _changed_numbers(record: BodiesRecord) -> str:
    """Return the numbers of the named body that differ from those of the config."""
    middles = {
        tolerance.key: (Fraction(tolerance.low) + Fraction(tolerance.high)) / 2
        for tolerance in record.tolerances
    }
    body = (record.body or {}).items()
    changed = [f"{key} = {value}" for key, value in body if Fraction(value) != middles[key]]
    return f"{', '.join(changed)}; the rest as in the config" if changed else "that of the config"


def largest_sentences(largest: Largest, fixed: Sequence[str]) -> list[str]:
    """Return sentences on the largest percentage of a key."""
    beside = f", with {tolerance_names(fixed)}" if fixed else ""
    by = " found by the time limit" if largest.late else ""
    what = f"Largest tolerance of {largest.key}{beside}{by}"
    if largest.percent is None or largest.record is None:
        return [f"{what}: none is proved.{_limit(largest)}"]
    first = f"{what}: ±{decimal_text(largest.percent)} %, proved.{_limit(largest)}"
    texts = [*fixed, f"{largest.key}=±{decimal_text(largest.percent)}%"]
    return [first, *within_sentences(texts, largest.record)]


def _limit(largest: Largest) -> str:
    if largest.not_proved is None:
        return ""
    percent = f"±{decimal_text(largest.not_proved)} %"
    if largest.why is None:
        return f" At {percent} a bound is not a valid number of a config."
    if largest.why.proved is False:
        return f" At {percent} it is false: {largest.why.outcome}."
    return f" At {percent} it is not decided{_why_undecided(largest.why)}."


def _why_undecided(record: BodiesRecord) -> str:
    """Return the end of a sentence on why a proof was not made."""
    why = f": {record.why}" if record.why else ""
    return why if record.outcome == "not decided" else f" ({record.outcome}{why})"


def tolerance_names(texts: Sequence[str]) -> str:
    """Return tolerances as words: `controller ±20 %, body.contact_point ±0.01`."""
    names = []
    for text in texts:
        key, _, size = text.partition("=")
        size = size.strip().lstrip("±+/-")
        percent = " %" if size.endswith("%") else ""
        names.append(f"{key} ±{size.rstrip('%')}{percent}")
    return ", ".join(names)


def _count(number: int, singular: str, plural: str = "") -> str:
    return f"{grouped(number)} {singular if number == 1 else plural or f'{singular}s'}"
