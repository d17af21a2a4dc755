"""Running the file of an element of a user, and the class in it.

This is the only place where code of a user runs, and only a caller that has the user's permission
may come here. There is no sandbox: the file can do all that the user can do.
"""

import linecache
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field, fields, is_dataclass
from functools import lru_cache, partial
from threading import RLock
from types import ModuleType, TracebackType
from typing import Any

import numpy as np

from rbstab.elements.element import Element
from rbstab.elements.user_code.declared import declared, sha256
from rbstab.mechanics.motion import Motion, Wrench
from rbstab.mechanics.numbers import Array

_PREFIX, _CODE = "rbstab_user_code_", "__rbstab_code__"
"""The beginning of the names of the modules, and the name in each of them of its `UserCode`."""

_RUNNING = RLock()
"""Held while a file runs: all threads must get the same class."""


_OF_THE_PROGRAM = ("supplied", "timed", "holds", "slides")
"""What no class of a user can state: it is passive, and depends on the motion alone."""


class UserCodeError(Exception):
    """The code of a user fails, or is not an element.

    Args:
        text: What is wrong, as in the message of a config.
    """


@dataclass(frozen=True)
class UserCode:
    """The text of a file.

    Args:
        source: The text.
        file: The name of the file, for messages.
    """

    source: str
    file: str

    @property
    def path(self) -> str:
        """The name of the file in tracebacks: unique for its text."""
        return f"<{self.file} {sha256(self.source)[:12]}>"


@lru_cache(64)
def module_of(code: UserCode) -> ModuleType:
    """Run a file, once for a process, and return its module.

    Raises:
        UserCodeError: It cannot be run.
    """
    with _RUNNING:
        name = f"{_PREFIX}{sha256(code.file + code.source)[:32]}"
        if name in sys.modules:
            return sys.modules[name]
        module = ModuleType(name)
        module.__file__, module.__dict__[_CODE] = code.path, code
        # Tracebacks show the lines, and dataclasses look up the module of their annotations.
        lines = code.source.splitlines(keepends=True)
        linecache.cache[code.path] = (len(code.source), None, lines, code.path)
        sys.modules[name] = module
        try:
            exec(compile(code.source, code.path, "exec"), module.__dict__)  # noqa: S102 (allowed)
        except (Exception, SystemExit) as error:
            del sys.modules[name]
            raise UserCodeError(f"cannot be run: {failure(code, error)}") from error
        return module


@lru_cache(64)
def element_class(code: UserCode, class_name: str) -> type[Element]:
    """Run a file, and return an element class in it, as a frozen dataclass of its declarations.

    Raises:
        UserCodeError: The file cannot be run, or the class is not an element.
        DeclarationError: As `declared`.
    """
    stated = declared(code.source, class_name)
    user_class = getattr(module_of(code), class_name, None)
    if not (isinstance(user_class, type) and issubclass(user_class, Element)):
        raise UserCodeError(f"{class_name} is not a class derived from rbstab.elements.Element")
    if (user_class.gains, user_class.mode_count, user_class.states) != stated[:3]:
        raise UserCodeError(
            f"{class_name} has other gains, modes or states than those written in its class"
        )
    for stated_name in _OF_THE_PROGRAM:
        if getattr(user_class, stated_name) is not getattr(Element, stated_name):
            raise UserCodeError(
                f"{class_name} states `{stated_name}`, which no element of a user can have"
            )
    names = ["name", *(gain.name for gain in stated.gains)]
    names += ["mode"] if stated.mode_count else []

    def reduced(self: Any) -> tuple[Any, ...]:
        # Another process has no module of this name; it runs the text again.
        return _element, (code, class_name, {name: getattr(self, name) for name in names})

    body = {"from_user": True, "__reduce__": reduced, "__module__": user_class.__module__}
    if is_dataclass(user_class):
        kind: Any = type(class_name, (user_class,), body)
    else:
        body["__annotations__"] = dict.fromkeys(names, Any)
        if stated.mode_count:
            body["mode"] = field(default_factory=partial(np.zeros, stated.mode_count))
        kind = dataclass(frozen=True, eq=False, kw_only=True)(type(class_name, (user_class,), body))
    if sorted(attribute.name for attribute in fields(kind)) != sorted(names):
        raise UserCodeError(f"{class_name} has other fields than {', '.join(names)}")
    checked: type[Element] = kind
    return checked


def element_classes(code: UserCode) -> Iterator[type[Element]]:
    """Run a file, and yield each class of its own that is an element and states a wrench.

    Raises:
        UserCodeError: As `element_class`.
        DeclarationError: As `declared`.
    """
    module = module_of(code)
    for name, member in list(vars(module).items()):
        is_defined_here = isinstance(member, type) and member.__module__ == module.__name__
        if is_defined_here and issubclass(member, Element) and member.wrench is not Element.wrench:
            yield element_class(code, name)


def failure(code: UserCode, error: BaseException) -> str:
    """Return an error as text, with the last line of a file in which it happened if there is one.

    Args:
        code: The file.
        error: The error.
    """
    where = line_of(error.__traceback__, code.path)
    if where is None and isinstance(error, SyntaxError):
        where = error.lineno
    message = str(error) or "no message"
    text = f"{type(error).__name__}: {message}"
    return text if where is None else f"line {where}: {text}"


def failure_in_user_code(error: BaseException) -> str | None:
    """Return an error with its file and line, if it happened in a file of a user; else None."""
    for module in list(sys.modules.values()):
        if getattr(module, "__name__", "").startswith(_PREFIX):
            code: UserCode = module.__dict__[_CODE]
            if line_of(error.__traceback__, code.path) is not None:
                return f"{code.file}: {failure(code, error)}"
    return None


def line_of(traceback: TracebackType | None, path: str) -> int | None:
    """Return the last line of a file in a traceback; None if it is not in it."""
    line = None
    while traceback is not None:
        if traceback.tb_frame.f_code.co_filename == path:
            line = traceback.tb_lineno
        traceback = traceback.tb_next
    return line


def wrong_values(element: Element, motion: Motion, states: Array) -> Iterator[str]:
    """Yield what the statements of an element return that is not of the right type and shape.

    Args:
        element: The element.
        motion: A motion of floats.
        states: The own states.
    """
    wrench = element.wrench(motion, states)
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
        value = getattr(element, statement)(motion, states)
        if np.shape(value) != shape:
            expected = f"{shape[0]} numbers" if shape else "one number"
            yield f"{statement} returns {_described(value)} (expected {expected})"


def _described(value: Any) -> str:
    if isinstance(value, np.ndarray):
        return f"an array of shape {value.shape}"
    return "nothing" if value is None else f"a {type(value).__name__}"


def _element(code: UserCode, class_name: str, values: dict[str, Any]) -> Element:
    return element_class(code, class_name)(**values)
