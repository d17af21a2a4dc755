"""What a class of a user declares, read from the text of its file without running it.

So the parameters of a config are checked, and the units of a stored result are known, although no
code of the file runs.
"""

import ast
import hashlib
import keyword
import math
import re
from collections.abc import Callable, Iterator
from functools import lru_cache
from typing import Any, NamedTuple, get_args

from rbstab.elements.declarations import ANCHOR, POINT, Gain, OwnState, Shape, is_initial

MAX_SOURCE = 100_000
"""The largest number of characters of a file."""

MAX_GAINS = 50
MAX_MODES = 20
MAX_STATES = 20
MAX_STATE_SIZE = 50

RESERVED = frozenset(
    {"name", "mode", "gains", "states", "own_states", "mode_count", "state_size", "from_user"}
    | {"wrench", "stored", "dissipated", "supplied", "rates", "guards"}
    | {"supplies", "holds", "slides", "timed"}
)
"""Names of an element that no parameter can have."""

_CONSTANTS = {"POINT": POINT, "ANCHOR": ANCHOR}
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,39}")
_STATE_NAME = re.compile(r"[a-z][a-z0-9_]{0,39}")
_LONGEST = {"unit": 40, "description": 200, "symbol": 20}
"""The largest number of characters of the texts of a gain or an own state."""


class Declared(NamedTuple):
    """What a class declares.

    Attributes:
        gains: Its gains, which are parameters in a config.
        mode_count: The number of its switches.
        states: Its own states; their initial values are parameters as well.
        supplies: Whether its text in the file defines the power that it supplies.
    """

    gains: tuple[Gain, ...]
    mode_count: int
    states: tuple[OwnState, ...] = ()
    supplies: bool = False


class DeclarationError(ValueError):
    """A file, or the declarations of a class in it, are wrong.

    Attributes:
        problem: What is wrong, as in the message of a config.
        expected: What was expected.
        line: The line in the file, from 1; None if it is about the whole file.
    """

    def __init__(self, problem: str, expected: str = "", line: int | None = None) -> None:
        super().__init__(problem if line is None else f"line {line}: {problem}")
        self.problem, self.expected, self.line = problem, expected, line


def sha256(source: str) -> str:
    """Return the SHA-256 of the text of a file, 64 hexadecimal digits."""
    return hashlib.sha256(source.encode()).hexdigest()


@lru_cache(256)
def declared(source: str, class_name: str) -> Declared:
    """Return what a class declares, from the text of its file; nothing of it runs.

    Raises:
        DeclarationError: The text is not Python, has no such class, or its declarations are not
            written as the constants that they must be.
    """
    classes = classes_of(source)
    if class_name not in classes:
        names = ", ".join(classes) or "none"
        raise DeclarationError("is not a class of the file", f"expected one of its own: {names}")
    gains, modes = _gains(class_name, classes), _mode_count(class_name, classes)
    states, supplies = _states(class_name, classes), _defines("supplied", class_name, classes)
    return Declared(gains, modes, states, supplies)


def classes_of(source: str) -> dict[str, ast.ClassDef]:
    """Return the classes at the top level of a file by name, in its order.

    Raises:
        DeclarationError: The text is not Python.
    """
    try:
        module = ast.parse(source)
    except SyntaxError as error:
        raise DeclarationError(f"is not Python: {error.msg}", "", error.lineno) from error
    except (ValueError, MemoryError, RecursionError) as error:
        raise DeclarationError("is not Python, or is nested too deeply") from error
    return {node.name: node for node in module.body if isinstance(node, ast.ClassDef)}


def _gains(class_name: str, classes: dict[str, ast.ClassDef]) -> tuple[Gain, ...]:
    kind = _Kind(Gain, "gain", 'Gain("k", "N/m", "meaning", shape="number")', MAX_GAINS, _problems)
    return _listed("gains", kind, class_name, classes)


def _states(class_name: str, classes: dict[str, ast.ClassDef]) -> tuple[OwnState, ...]:
    example = 'OwnState("stretch", "z", "m", "meaning", size=3)'
    kind = _Kind(OwnState, "own state", example, MAX_STATES, _problems_of_state)
    return _listed("states", kind, class_name, classes)


class _Kind(NamedTuple):
    """A kind of declaration.

    Attributes:
        made: The class that a declaration calls.
        words: What it declares, in words.
        example: A declaration.
        most: The largest number of them.
        problems: Yields what is wrong with one, and what was expected.
    """

    made: type[Any]
    words: str
    example: str
    most: int
    problems: Callable[[Any], Iterator[tuple[str, str]]]


def _listed(
    attribute: str, kind: _Kind, class_name: str, classes: dict[str, ast.ClassDef]
) -> tuple[Any, ...]:
    """Return the declarations that a class assigns to an attribute."""
    node = _assigned(attribute, class_name, classes)
    if node is None:
        return ()
    name = kind.made.__name__
    if not isinstance(node, ast.Tuple | ast.List):
        problem = f"has {attribute} that are no tuple"
        raise DeclarationError(problem, f"expected ({name}(...),)", node.lineno)
    if len(node.elts) > kind.most:
        problem = f"has {len(node.elts)} {attribute}"
        raise DeclarationError(problem, f"expected at most {kind.most}", node.lineno)
    found = tuple(_declaration(entry, kind) for entry in node.elts)
    names = [one.name for one in found]
    if len(set(names)) < len(names):
        raise DeclarationError(f"has two {attribute} of the same name", "", node.lineno)
    return found


def _declaration(node: ast.expr, kind: _Kind) -> Any:
    name, expected = kind.made.__name__, f"expected {kind.example}"
    if kind.made is Gain and isinstance(node, ast.Name) and node.id in _CONSTANTS:
        return _CONSTANTS[node.id]
    if not (isinstance(node, ast.Call) and _name_of(node.func) == name):
        article = "an" if kind.words[0] in "aeiou" else "a"
        problem = f"has {article} {kind.words} that cannot be read without running the file"
        raise DeclarationError(problem, expected, node.lineno)
    try:
        positional = [ast.literal_eval(argument) for argument in node.args]
        named = {word.arg or "**": ast.literal_eval(word.value) for word in node.keywords}
        made = kind.made(*positional, **named)
    except (TypeError, ValueError, SyntaxError, MemoryError, RecursionError) as error:
        problem = f"has a {name}(...) whose arguments are not plain texts, numbers, True or False"
        raise DeclarationError(problem, expected, node.lineno) from error
    for problem, wanted in kind.problems(made):
        raise DeclarationError(f"has a {name} whose {problem}", f"expected {wanted}", node.lineno)
    return made


def _problems_of_state(state: OwnState) -> Iterator[tuple[str, str]]:
    """Yield what is wrong with an own state, and what was expected."""
    name, size = state.name, state.size
    if not (isinstance(name, str) and _STATE_NAME.fullmatch(name)):
        yield f"name is {name!r:.50}", "a lower-case letter, then up to 39 of a to z, digits or _"
    yield from _problems_of_texts(state, ("symbol", "unit", "description"))
    if type(size) is not int or not 1 <= size <= MAX_STATE_SIZE:
        yield f"size is {size!r:.50}", f"a whole number from 1 to {MAX_STATE_SIZE}"


def _problems_of_texts(made: Any, fields: tuple[str, ...]) -> Iterator[tuple[str, str]]:
    """Yield which texts of a declaration are none, or too long."""
    for field in fields:
        text, longest = getattr(made, field), _LONGEST[field]
        if not (isinstance(text, str) and text.isprintable() and len(text) <= longest):
            yield f"{field} is {text!r:.50}", f"a text of at most {longest} characters"


def _problems(gain: Gain) -> Iterator[tuple[str, str]]:
    """Yield what is wrong with a gain, and what was expected."""
    name, shapes = gain.name, get_args(Shape)
    if not (isinstance(name, str) and _NAME.fullmatch(name)) or keyword.iskeyword(name):
        yield f"name is {name!r:.50}", "a letter, then up to 39 letters, digits or _"
    elif name in RESERVED:
        yield f"name is {name}, which every element uses", "another name"
    elif is_initial(name):
        yield f"name is {name}, as initial values of own states begin", "another name"
    yield from _problems_of_texts(gain, ("unit", "description"))
    if gain.shape not in shapes:
        yield f"shape is {gain.shape!r:.50}", f"one of {', '.join(shapes)}"
    if gain.shape == "direction" and gain.positive is False:
        yield "direction has positive=False", "no `positive`: a direction has none"
    if not all(isinstance(x, bool) for x in (gain.positive, gain.dissipates, gain.or_zero)):
        yield "positive, dissipates or or_zero is not a truth value", "True or False"
    if gain.or_zero is True and gain.shape != "number":
        yield "or_zero is True", "it for a number only"
    if gain.default is not None and not (gain.shape == "number" and _is_number(gain.default)):
        yield f"default is {gain.default!r:.50}", "a number that is not negative, for a number"
    for field in ("below", "at_most"):
        bound = getattr(gain, field)
        if bound is not None and not (gain.shape == "number" and _is_number(bound)):
            yield f"bound `{field}` is {bound!r:.50}", "a positive number, for a number"


def _is_number(value: Any) -> bool:
    is_real = isinstance(value, int | float) and not isinstance(value, bool)
    return is_real and 0 <= value < math.inf


def _mode_count(class_name: str, classes: dict[str, ast.ClassDef]) -> int:
    node = _assigned("mode_count", class_name, classes)
    if node is None:
        return 0
    value = node.value if isinstance(node, ast.Constant) else None
    if type(value) is not int or not 0 <= value <= MAX_MODES:
        expected = f"expected a whole number up to {MAX_MODES}"
        raise DeclarationError("has a mode_count that is no such number", expected, node.lineno)
    return value


def _assigned(
    name: str, class_name: str, classes: dict[str, ast.ClassDef], seen: tuple[str, ...] = ()
) -> ast.expr | None:
    """Return what a class assigns to a name, or the first of its bases in the same file does."""
    node = classes[class_name]
    found: ast.expr | None = None
    for statement in node.body:
        if isinstance(statement, ast.AnnAssign):
            targets: list[ast.expr] = [statement.target]
            value = statement.value
        elif isinstance(statement, ast.Assign):
            targets, value = statement.targets, statement.value
        else:
            continue
        if value is not None and any(_name_of(target) == name for target in targets):
            found = value
    if found is not None:
        return found
    for base in _bases_in_file(class_name, classes, seen):
        inherited = _assigned(name, base, classes, (*seen, class_name))
        if inherited is not None:
            return inherited
    return None


def _defines(
    method: str, class_name: str, classes: dict[str, ast.ClassDef], seen: tuple[str, ...] = ()
) -> bool:
    """Return whether a class, or one of its bases in the same file, defines a method."""
    body = classes[class_name].body
    if any(isinstance(node, ast.FunctionDef) and node.name == method for node in body):
        return True
    bases = _bases_in_file(class_name, classes, seen)
    return any(_defines(method, base, classes, (*seen, class_name)) for base in bases)


def _bases_in_file(
    class_name: str, classes: dict[str, ast.ClassDef], seen: tuple[str, ...]
) -> list[str]:
    """Return the bases of a class that its file has, without those that were seen."""
    bases = map(_name_of, classes[class_name].bases)
    return [base for base in bases if base in classes and base not in (*seen, class_name)]


def _name_of(node: ast.expr) -> str:
    """Return the last part of a name such as `Gain` or `elements.Gain`; "" for anything else."""
    if isinstance(node, ast.Name):
        return node.id
    return node.attr if isinstance(node, ast.Attribute) else ""
