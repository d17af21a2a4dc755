"""Tolerances of the numbers of a config: `--within controller.K_r=±20%`.

A config with tolerances means every config whose numbers lie between the bounds.
"""

import re
from collections.abc import Iterable
from dataclasses import dataclass, replace
from decimal import Decimal
from fractions import Fraction

from rbstab.config.errors import (
    ConfigError,
    ConfigProblem,
    Location,
    closest_keys,
    did_you_mean,
)
from rbstab.config.load import with_numbers
from rbstab.config.numbers import (
    Entry,
    entries_of,
    entries_under,
    is_of_initial_state,
    keys_of,
    unit_problem,
)
from rbstab.config.schema import Config
from rbstab.config.source import Path, key_of
from rbstab.config.units import NumberKey, names_in, number_key
from rbstab.files.text import shortened

OPTION = "--within"

SECTIONS = ("body", "controller", "elements", "gravity", "initial")
"""The sections whose numbers can have a tolerance."""

_SIZE = re.compile(
    r"(?:±|\+/-|\+-)(?P<number>(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,3})?)(?P<percent>%?)"
)

DEGREE = Fraction(314159265358979323847, 180 * 10**20)
"""The angle 1°, rad, rounded up, so that a tolerance in degrees has all that it names."""

LARGEST = 10**100
"""Tolerances are below this."""

_EXPECTED = (
    "expected KEY=±SIZE or KEY=±SIZE%, such as controller=±20% or body.contact_point=±0.01; "
    "+- may stand for ±"
)


@dataclass(frozen=True)
class Tolerance:
    """The bounds of an independent number of a config: middle ± radius, both included.

    Args:
        entry: The number, and where it is in the config.
        middle: The decimal that the number means.
        radius: The largest difference from it, above 0.
    """

    entry: Entry
    middle: Fraction
    radius: Fraction

    @property
    def section(self) -> str:
        """The section of the config; `initial` for the own states of elements too."""
        path = self.entry.paths[0]
        return "initial" if is_of_initial_state(path) else str(path[0])

    @property
    def bounds(self) -> tuple[str, str]:
        """Both bounds as exact decimals."""
        return decimal_text(self.low), decimal_text(self.high)

    @property
    def low(self) -> Fraction:
        """The lower bound."""
        return self.middle - self.radius

    @property
    def high(self) -> Fraction:
        """The upper bound."""
        return self.middle + self.radius


def tolerances_of_key(
    config: Config, key: str, option: str, fixed: Iterable[str] = ()
) -> tuple[Tolerance, ...]:
    """Return small tolerances of a key whose largest one is still to be found.

    Args:
        config: The config.
        key: The key, such as `controller.K_r`.
        option: The option that names it, for messages.
        fixed: The valid texts of other tolerances, which are returned too.

    Raises:
        ConfigError: The text is not a key, it has no numbers, all of them are 0, or one of them has
            a tolerance already.
    """
    where = Location(f"{option} {shortened(key)}")
    if "=" in key:
        expected = f"expected the key alone: {option} {shortened(key.partition('=')[0].strip())}"
        raise ConfigError.at(where, "has a size, which is to be found", expected)
    try:
        return tolerances_of(config, [*fixed, f"{key}=±0.001%"])
    except ConfigError as error:
        raise ConfigError(
            [replace(problem, location=where) for problem in error.problems]
        ) from error


def tolerances_of(config: Config, texts: Iterable[str]) -> tuple[Tolerance, ...]:
    """Return the tolerances of a config.

    A key may be a number, a vector, a matrix, or one of `SECTIONS`; the size then holds for each of
    its numbers. A size in percent is relative to each number, so a number that is 0 stays 0. A size
    is in degrees if the key ends in `.deg`, which is needed where the config gives degrees.

    Args:
        config: The config.
        texts: Texts `KEY=±SIZE` or `KEY=±SIZE%`; `+-` and `+/-` may stand for ±.

    Raises:
        ConfigError: A text is wrong, two give bounds for the same number, or a bound is not valid.
    """
    problems: list[ConfigProblem] = []
    tolerances: dict[Path, Tolerance] = {}
    for text in texts:
        try:
            new = _tolerances_in(config, text)
        except ConfigError as error:
            problems += error.problems
            continue
        twice = [tolerance.entry.key for tolerance in new if tolerance.entry.paths[0] in tolerances]
        if twice:
            problem = f"gives a second tolerance of {twice[0]}"
            problems += _refused(text, problem, "expected one of them").problems
            continue
        problems += _invalid_bounds(config, text, new)
        tolerances |= {tolerance.entry.paths[0]: tolerance for tolerance in new}
    if problems:
        raise ConfigError(problems)
    return tuple(tolerances.values())


def _tolerances_in(config: Config, text: str) -> list[Tolerance]:
    key, _, size = text.partition("=")
    match = _SIZE.fullmatch(size.strip())
    if match is None:
        raise _refused(text, "is not a tolerance", _EXPECTED)
    number = Fraction(match["number"])
    if number >= LARGEST:
        raise _refused(text, "is too large", "expected a size below 1e100")
    entries = entries_at(config, key)
    if not entries:
        problem = f"{shortened(key)} has no numbers that can have a tolerance"
        sections = [name for name in SECTIONS if entries_at(config, name)]
        meant = did_you_mean(closest_keys(key.partition("[")[0], [*sections, *keys_of(config)]))
        raise _refused(text, problem, meant or f"expected a key of {', '.join(sections)}")
    unit = Fraction(1) if match["percent"] else _unit(config, text, key, entries)
    tolerances = []
    for entry in entries:
        middle = Fraction(repr(entry.value))
        radius = abs(middle) * number / 100 if match["percent"] else number * unit
        if radius > 0:
            tolerances.append(Tolerance(entry, middle, radius))
    if not tolerances:
        problem = "is a tolerance of 0"
        if match["percent"] and number > 0:
            problem = f"is a tolerance of 0, because {shortened(key)} is 0"
        raise _refused(text, problem, "expected a size above 0")
    return tolerances


def _unit(config: Config, text: str, key: str, entries: Iterable[Entry]) -> Fraction:
    """Return the SI value of the unit of a key, as a tolerance; refuse numbers in another unit."""
    read = number_key(key)
    degrees = read is not None and read.degrees
    for entry in entries:
        whole = names_in(entry.paths[0])
        at = read.path if read is not None and len(read.path) > len(whole) else whole
        problem = unit_problem(config, NumberKey(at, degrees))
        if problem is not None:
            raise _refused(text, f"{key_of(at)} {problem[0]}", problem[1])
    return DEGREE if degrees else Fraction(1)


def decimal_text(number: Fraction) -> str:
    """Return a number as an exact decimal, or as a fraction if it has no finite decimal."""
    # A denominator 2^a 5^b divides 10^places.
    places = number.denominator.bit_length()
    scaled = number * 10**places
    if scaled.denominator != 1:
        return str(number)
    return f"{Decimal(f'{scaled.numerator}e-{places}'):f}".rstrip("0").rstrip(".")


def entries_at(config: Config, key: str) -> tuple[Entry, ...]:
    """Return the numbers of a key; none if the config has none there."""
    read = number_key(key)
    if read is None or read.path[0] not in SECTIONS:
        return ()
    path = read.path
    of_sections = (*entries_of(config), *entries_under(config, ("gravity",)))
    return tuple(
        entry
        for entry in of_sections
        if any(entry_path[: len(path)] == path for entry_path in entry.paths)
    )


def _invalid_bounds(config: Config, text: str, tolerances: list[Tolerance]) -> list[ConfigProblem]:
    """Return the problems of a config with all numbers at one of their bounds."""
    problems = {}
    for word in ("low", "high"):
        bounds = {
            path: float(getattr(tolerance, word))
            for tolerance in tolerances
            for path in tolerance.entry.paths
        }
        try:
            with_numbers(config, bounds)
        except ConfigError as error:
            for problem in error.problems:
                key = (problem.key, problem.problem)
                problems[key] = ConfigProblem(
                    _place(text),
                    problem.key,
                    f"at the {word} end of the tolerance: {problem.problem}",
                    problem.expected,
                )
    return list(problems.values())


def _place(text: str) -> Location:
    return Location(f"{OPTION} {shortened(text)}")


def _refused(text: str, problem: str, expected: str = "") -> ConfigError:
    return ConfigError.at(_place(text), problem, expected)
