"""Compares printed lines with those on a page: round-off and times that were taken may differ."""

import itertools
import math
import re


def lines_of(output):
    """Return the lines of an output, without spaces and empty lines at their ends."""
    return [line.rstrip() for line in output.strip("\n").splitlines()]


def agrees(shown, printed):
    """Return whether an output is what a page shows; `...` stands for any lines."""
    shown = [*itertools.dropwhile(lambda line: not line, shown)]
    while shown and not shown[-1]:
        shown = shown[:-1]
    parts = [
        [*lines] for elided, lines in itertools.groupby(shown, lambda x: x == "...") if not elided
    ]
    if "..." not in shown:
        return same(parts[0] if parts else [], printed)
    at = 0
    for number, part in enumerate(parts):
        if number == 0 and shown[0] != "...":
            places = [0]
        elif number == len(parts) - 1 and shown[-1] != "...":
            places = [len(printed) - len(part)]
        else:
            places = [*range(at, len(printed) - len(part) + 1)]
        fits = [n for n in places if n >= at and same(part, printed[n : n + len(part)])]
        if not fits:
            return False
        at = fits[0] + len(part)
    return True


def contains(printed, shown):
    """Return whether lines follow each other in an output."""
    return any(same(shown, printed[n : n + len(shown)]) for n in range(len(printed)))


def same(shown, printed):
    """Return whether lines say the same, but for round-off and the time that was taken."""
    if len(shown) != len(printed):
        return False
    pairs = zip(shown, printed, strict=True)
    return all(_same_line(without_time(a), without_time(b)) for a, b in pairs)


def without_time(line):
    """Return a line without what differs from one processor or moment to another."""
    line = re.sub(r"\b(in|about|,) [\d.e-]+ s\b(?=[^/]|$)", r"\1 # s", line)
    line = re.sub(r"error ≤ \S+ J", "error ≤ # J", line)
    # The last column of the table of `rbstab run` is the time that was taken.
    line = re.sub(r"^( \S+\.h5 .*?)\S+$", r"\1#", line)
    # Where a check has a value of round-off, the time of its maximum is chance.
    line = re.sub(r"(\de-1\d.*)  \S+$", r"\1  #", line)
    return re.sub(r"[\d.]+ (kB|MB)|\b[0-9a-f]{12,64}\b|\d members/s", "#", line)


NUMBER = re.compile(r"(?<![\w.])-?\d+\.?\d*(?:e[+-]?\d+)?")


def _same_line(shown, printed):
    a, b = (" ".join(NUMBER.sub("#", line).split()) for line in (shown, printed))
    numbers = zip(NUMBER.findall(shown), NUMBER.findall(printed), strict=True)
    return a == b and all(
        math.isclose(float(left), float(right), rel_tol=2e-3, abs_tol=2e-9)
        for left, right in numbers
    )
