"""The check of a file with elements of a user: each class, statement by statement."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rbstab.config.files.named_files import read_python
from rbstab.elements.element import Element
from rbstab.elements.user_code.loaded import (
    UserCode,
    UserCodeError,
    element_classes,
    failure,
)
from rbstab.experiment.element_check import probes, switches
from rbstab.experiment.element_check.states import Sample, samples_of
from rbstab.experiment.element_check.switches import JUMP, Switch, force_at_rest
from rbstab.integrate.straight_line.equations import StraightLine
from rbstab.proof.passive.passive import in_proofs, why_not_in_proofs
from rbstab.systems.coordinates import CentreCoordinates, ReducedCoordinates

STATES = 100
"""The number of random states."""

BALL_STATES = 10
"""The number of them that are evaluated in balls, which are slow."""

CONTACT_POINT = np.array([0.1, 0.2, 0.3])
"""m, body coordinates."""

USABLE = "floats pass, with finite values of the right shapes"
AT_REST = "the wrench on a body at rest is the slope of `stored`"
IN_MOTION = "stored' + dissipated = -(power of the wrench), and `dissipated` is not negative"

Find = Callable[[], Iterator[str]]


class Checked(NamedTuple):
    """A class of a file, with what was found.

    Attributes:
        name: The name of the class.
        passed: The statements that hold, in words.
        problems: The statements that do not hold, each with the first state where it fails.
        notes: What else is worth knowing.
    """

    name: str
    passed: tuple[str, ...]
    problems: tuple[str, ...]
    notes: tuple[str, ...]


class ElementFileError(Exception):
    """A file cannot be read or run, or has no element; the text says why."""


def check_file(path: Path) -> tuple[Checked, ...]:
    """Run a file, and check every element class in it at random states.

    Args:
        path: The Python file. It can do all that the user can do.

    Raises:
        ElementFileError: It cannot be read or run, or has no element.
    """
    try:
        code = UserCode(read_python(path), path.name)
        classes = list(element_classes(code))
    except (OSError, ValueError, UserCodeError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        expected = getattr(error, "expected", "")
        raise ElementFileError(f"{reason} ({expected})" if expected else reason) from error
    if not classes:
        raise ElementFileError("has no class derived from rbstab.elements.Element with a wrench")
    return tuple(check_class(kind, code) for kind in classes)


def check_class(kind: type[Element], code: UserCode) -> Checked:
    """Check an element class at random states, with random parameters of its declared gains."""
    passed, problems, notes = list[str](), dict[str, str](), list[str]()
    with np.errstate(all="ignore"):
        samples = samples_of(kind, STATES)
        # They are looked for once, and not before the event functions are known to be usable.
        crossed = list[Switch]()
        for words, find in _checks(kind, samples, crossed, code).items():
            if words == IN_MOTION and AT_REST in problems:
                continue  # it would blame the wrong statement
            try:
                problem = next(find(), None)
            except Exception as error:
                problem = f"a statement fails: {failure(code, error)}"
            if problem is None:
                passed.append(words)
                continue
            problems[words] = problem
            if words == USABLE:
                break  # nothing else can be computed
        if not problems:
            notes += _notes(samples, crossed)
    return Checked(kind.__name__, tuple(passed), tuple(problems.values()), tuple(notes))


def _checks(
    kind: type[Element], samples: list[Sample], crossed: list[Switch], code: UserCode
) -> dict[str, Find]:
    """Return each check by what it shows, in words."""

    def each(problems: Callable[[Sample], Iterator[str]], count: int | None = None) -> Find:
        return lambda: (f"{problem}; {s.words}" for s in samples[:count] for problem in problems(s))

    def jumps() -> Iterator[str]:
        crossed.extend(switches.switches_between(samples))
        return switches.jump_problems(crossed)

    checks = {
        USABLE: each(probes.unusable),
        "complex numbers pass, and have the slopes of differences": each(
            partial(probes.complex_problems, code)
        ),
        "balls of python-flint pass": each(partial(probes.ball_problems, code), BALL_STATES),
        "no statement depends on the time": each(probes.timed),
        "`stored` depends on no velocity": each(probes.problems_of_velocities),
        AT_REST: each(probes.problems_at_rest),
        IN_MOTION: each(probes.problems_in_motion),
    }
    if kind.state_size:
        # What the wrench gives at rest may go into own states; the balance in motion counts it.
        del checks[AT_REST]
    if _has_heyoka():
        checks["heyoka's expressions pass"] = partial(probes.heyoka_problems, samples, code)
    if kind.mode_count:
        checks["`guards` depends on positions only"] = each(switches.guard_problems)
        checks["`stored` is continuous at each switch"] = jumps
    if kind.kinked:
        checks["`stored` is linear in each mode, as `kinked` says"] = each(switches.kink_problems)
    return checks


def _has_heyoka() -> bool:
    return find_spec("heyoka") is not None


def _notes(samples: list[Sample], crossed: list[Switch]) -> Iterator[str]:
    sample = samples[0]
    line = StraightLine(probes.values, sample.system, sample.system.size)
    if line.finite_value(sample.y) is None:
        yield (
            "SciPy's engine evaluates it with numpy, which is some 15 times slower: it uses an "
            "operation that cannot be traced"
        )
    for index in sorted(
        set(range(sample.element.mode_count)) - {switch.event for switch in crossed}
    ):
        yield (
            f"event function {index + 1} has one sign at all these states, so that nothing was "
            "tested at its switch"
        )
    jumps = (switch.sides(force_at_rest, JUMP) is not None for switch in crossed)
    if not sample.element.kinked and any(jumps):
        yield (
            "its force jumps at a switch: declare `kinked = True` in the class, so that searches "
            "find rest states at which it holds the body"
        )
    yield _in_which_proofs(sample)
    if not _has_heyoka():
        yield "heyoka is not installed, so its expressions were not tried"


def _in_which_proofs(sample: Sample) -> str:
    """Return whether proofs take an element into account, as a sentence."""
    element, never = sample.element, "no proof takes it into account: "
    if element.supplies:
        return f"{never}it supplies power"
    if not in_proofs(element):
        return f"{never}it has own states beside switches, or too many switches"
    # Away from the contact point, so that the centre moves.
    body = replace(sample.system.body, contact_point=CONTACT_POINT)
    for coordinates, words in (
        (ReducedCoordinates(), never),
        (CentreCoordinates(), "proofs of a held body take it into account, those of other bodies "
                              "do not: "),
    ):  # fmt: skip
        why = why_not_in_proofs(replace(sample.system, body=body, coordinates=coordinates))
        if why is not None:
            return f"{words}{why.partition(': ')[2]}"
    return "proofs take it into account"
