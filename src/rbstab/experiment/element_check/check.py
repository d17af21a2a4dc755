"""The check of a file with elements of a user: each class, statement by statement."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rbstab.config.files.named_files import read_python
from rbstab.elements.element import Element
from rbstab.elements.user_code.declared import DeclarationError
from rbstab.elements.user_code.loaded import (
    UserCode,
    UserCodeError,
    element_classes,
    failure,
    wrong_values,
)
from rbstab.experiment.element_check.kinds_of_number import (
    ball_problems,
    complex_problems,
    has_heyoka,
    heyoka_problems,
    is_traced,
)
from rbstab.experiment.element_check.power import (
    problems_at_rest,
    problems_in_motion,
    problems_of_velocities,
)
from rbstab.experiment.element_check.states import Sample, samples_of, with_state
from rbstab.experiment.element_check.switches import (
    force_jumps,
    guard_problems,
    jump_problems,
    kink_problems,
    untested_switches,
)
from rbstab.proof.passive.passive import in_proofs, why_not_in_proofs
from rbstab.systems.coordinates import CentreCoordinates, Coordinates, ReducedCoordinates
from rbstab.systems.system import System

STATES = 100
"""The number of random states."""

BALL_STATES = 10
"""The number of them that are evaluated in balls, which are slow."""


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
    passed, problems, wrong = [], [], set[str]()
    with np.errstate(all="ignore"):
        samples = samples_of(kind, STATES)
        for words, find in _checks(kind, samples, code).items():
            if words == IN_MOTION and AT_REST in wrong:
                continue  # it would blame the wrong statement
            found = _first(find, code)
            if found is None:
                passed.append(words)
                continue
            problems.append(found)
            if words == USABLE:
                break  # nothing else can be computed
            wrong.add(words)
        notes = [] if problems else list(_notes(samples))
    return Checked(kind.__name__, tuple(passed), tuple(problems), tuple(notes))


USABLE = "floats pass, with finite values of the right shapes"
AT_REST = "the wrench on a body at rest is the slope of `stored`"
IN_MOTION = "stored' + dissipated = -(power of the wrench), and `dissipated` is not negative"

Find = Callable[[], Iterator[str]]


def _checks(kind: type[Element], samples: list[Sample], code: UserCode) -> dict[str, Find]:
    """Return each check by what it shows, in words."""

    def each(problems: Callable[[Sample], Iterator[str]]) -> Find:
        return lambda: (f"{found}; {s.words}" for s in samples for found in problems(s))

    checks = {
        USABLE: each(_unusable),
        "complex numbers pass, and have the slopes of differences": lambda: complex_problems(
            samples, code
        ),
        "balls of python-flint pass": lambda: ball_problems(samples[:BALL_STATES], code),
        "no statement depends on the time": each(_timed),
        "`stored` depends on no velocity": each(problems_of_velocities),
        AT_REST: each(problems_at_rest),
        IN_MOTION: each(problems_in_motion),
    }
    if kind.state_size:
        # What the wrench gives at rest may go into own states; the balance in motion counts it.
        del checks[AT_REST]
    if has_heyoka():
        checks["heyoka's expressions pass"] = lambda: heyoka_problems(samples, code)
    if kind.mode_count:
        pairs = [(s, with_state(s, t.y)) for s, t in pairwise(samples)]
        checks["`guards` depends on positions only"] = each(guard_problems)
        checks["`stored` is continuous at each switch"] = lambda: (
            f"{found}; {one.words}" for one, other in pairs for found in jump_problems(one, other)
        )
    if kind.kinked:
        checks["`stored` is linear in each mode, as `kinked` says"] = each(kink_problems)
    return checks


def _unusable(sample: Sample) -> Iterator[str]:
    """Yield what the statements return that is not finite, or not of the right type and shape."""
    element, motion, own = sample.element, sample.motion, sample.own
    wrong = list(wrong_values(element, motion, own))
    yield from wrong
    if wrong:
        return
    wrench = element.wrench(motion, own)
    for name, value in (
        ("wrench", np.concatenate(wrench)),
        ("stored", element.stored(motion, own)),
        ("dissipated", element.dissipated(motion, own)),
        ("rates", element.rates(motion, own)),
    ):
        if not np.isfinite(value).all():
            yield f"`{name}` is not finite"


def _timed(sample: Sample) -> Iterator[str]:
    """Yield a statement that depends on the time: only inputs may."""
    element, motions = sample.element, [sample.system.motion(sample.y, t) for t in (0.0, 1.0)]
    for name in ("rates", "wrench", "stored", "dissipated", "guards"):
        one, other = (np.ravel(getattr(element, name)(motion, sample.own)) for motion in motions)
        if np.any(one != other):
            yield f"`{name}` depends on `motion.time`; only inputs of the program may"


def _first(find: Find, code: UserCode) -> str | None:
    """Return the first problem; an error of the code is one."""
    try:
        return next(find(), None)
    except Exception as error:
        return f"a statement fails: {failure(code, error)}"


def _notes(samples: list[Sample]) -> Iterator[str]:
    sample = samples[0]
    if not is_traced(sample):
        yield (
            "SciPy's engine evaluates it with numpy, which is some 15 times slower: it uses an "
            "operation that cannot be traced"
        )
    pairs = [(s, with_state(s, t.y)) for s, t in pairwise(samples)]
    for number in untested_switches(pairs):
        yield (
            f"event function {number} has one sign at all these states, so that nothing was tested "
            "at its switch"
        )
    if not sample.element.kinked and any(force_jumps(one, other) for one, other in pairs):
        yield (
            "its force jumps at a switch: declare `kinked = True` in the class, so that searches "
            "find rest states at which it holds the body"
        )
    yield in_which_proofs(sample.system, sample.element)
    if not has_heyoka():
        yield "heyoka is not installed, so its expressions were not tried"


CONTACT_POINT = np.array([0.1, 0.2, 0.3])
"""m, body coordinates."""


def in_which_proofs(system: System, element: Element) -> str:
    """Return whether proofs take an element into account, as a sentence.

    Args:
        system: A system in which the element acts.
        element: The element.
    """
    why = _why_never(element) or _why_not(system, element, ReducedCoordinates())
    if why is not None:
        return f"no proof takes it into account: {why}"
    why = _why_not(system, element, CentreCoordinates())
    if why is not None:
        return f"proofs of a held body take it into account, those of other bodies do not: {why}"
    return "proofs take it into account"


def _why_never(element: Element) -> str | None:
    if element.supplies:
        return "it supplies power"
    return None if in_proofs(element) else "it has own states beside switches, or too many switches"


def _why_not(system: System, element: Element, coordinates: Coordinates) -> str | None:
    """Return why no proof takes an element into account in some coordinates."""
    # Away from the contact point, so that the centre moves.
    body = replace(system.body, contact_point=CONTACT_POINT)
    alone = replace(system, body=body, elements=(element,), coordinates=coordinates)
    why = why_not_in_proofs(alone)
    return None if why is None else why.partition(": ")[2]


__all__ = ["Checked", "DeclarationError", "ElementFileError", "check_class", "check_file"]
