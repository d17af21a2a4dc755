"""A trial of the statements of a user's element, at the start of its config."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from rbstab.config.build import start_of, system_of
from rbstab.config.user_code.permission import only_code_of
from rbstab.elements.element import Element
from rbstab.elements.user_code.loaded import DeclarationError, UserCodeError, failure
from rbstab.mechanics.motion import Motion, Wrench
from rbstab.mechanics.numbers import Array


def problem_at_start(config: Any, name: str) -> str | None:
    """Return what is wrong with an element of a user at the start of a config; None if nothing.

    Args:
        config: The config; its code may run.
        name: The name of the element.
    """
    code = config.elements[name].code
    try:
        with np.errstate(all="ignore"):
            system = system_of(only_code_of(config, name))
            motion, pairs = system.acting(start_of(config, system))
            element, own = next(pair for pair in pairs if pair[0].name == name)
            return next(wrong_values(element, motion, own), None)
    except (UserCodeError, DeclarationError) as error:
        return str(error)
    except Exception as error:
        return f"it fails at the start: {failure(code, error)}"


def wrong_values(element: Element, motion: Motion, own: Array) -> Iterator[str]:
    """Yield what the statements of an element return that is not of the right type and shape.

    Args:
        element: The element.
        motion: A motion of floats.
        own: The own states.
    """
    wrench = element.wrench(motion, own)
    if not isinstance(wrench, Wrench):
        yield (
            f"wrench returns {_described(wrench)} (expected a Wrench, as force_at_centre, "
            "couple_on_body, force_at_contact and force_at return it)"
        )
        return
    for part, value in zip(Wrench._fields, wrench, strict=True):
        if np.shape(value) != (3,):
            yield f"the {part} of wrench is {_described(value)} (expected three numbers)"
    shapes: dict[str, tuple[int, ...]] = {"stored": (), "dissipated": ()}
    shapes |= {"guards": (element.mode_count,)} if element.mode_count else {}
    shapes |= {"rates": (element.state_size,)} if element.state_size else {}
    for statement, shape in shapes.items():
        value = getattr(element, statement)(motion, own)
        if np.shape(value) != shape:
            expected = f"{shape[0]} numbers" if shape else "one number"
            yield f"{statement} returns {_described(value)} (expected {expected})"


def _described(value: Any) -> str:
    if isinstance(value, np.ndarray):
        return f"an array of shape {value.shape}"
    return "nothing" if value is None else f"a {type(value).__name__}"
