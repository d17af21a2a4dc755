"""What a class of a user declares, read from the text of its file without running it.

So the parameters of a config are checked, and the units of a stored result are known, although no
code of the file runs.
"""

import ast
import hashlib
import keyword
from collections.abc import Iterable, Iterator
from functools import lru_cache
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    ValidationError,
    model_validator,
)

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


def _printable(text: str) -> str:
    if not text.isprintable():
        raise ValueError("a text without control characters is expected")
    return text


def _free(name: str) -> str:
    if name in RESERVED or keyword.iskeyword(name) or is_initial(name):
        raise ValueError(f"{name} is the name of something else")
    return name


_Unit = Annotated[str, Field(max_length=40), AfterValidator(_printable)]
_Description = Annotated[str, Field(max_length=200), AfterValidator(_printable)]
_Number = Annotated[float, Field(ge=0, allow_inf_nan=False)] | None


class _Form(BaseModel):
    """The form of a declaration: what its arguments may be."""

    model_config = ConfigDict(strict=True, extra="forbid", defer_build=True)


class _GainForm(_Form):
    """The form of a gain."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]{0,39}$"), AfterValidator(_free)]
    unit: _Unit
    description: _Description
    shape: Shape
    positive: bool
    dissipates: bool
    default: _Number
    below: _Number
    at_most: _Number
    or_zero: bool
    key: Literal[""]  # the key of an element of a user is its name

    @model_validator(mode="after")
    def _check_shape(self) -> "_GainForm":
        if self.shape == "direction" and not self.positive:
            raise ValueError("a direction has no `positive`")
        of_number = (self.default, self.below, self.at_most, self.or_zero or None)
        if self.shape != "number" and of_number != (None,) * 4:
            raise ValueError("default, below, at_most and or_zero are for a number only")
        return self


class _StateForm(_Form):
    """The form of an own state."""

    name: Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]{0,39}$")]
    symbol: Annotated[str, Field(max_length=20), AfterValidator(_printable)]
    unit: _Unit
    description: _Description
    size: Annotated[int, Field(ge=1, le=MAX_STATE_SIZE)]


class _Kind(NamedTuple):
    """A kind of declaration: the class that is called, its form, an example, the most of them."""

    made: type[Any]
    form: type[_Form]
    example: str
    most: int


_GAINS = _Kind(Gain, _GainForm, 'Gain("k", "N/m", "meaning", shape="number")', MAX_GAINS)
_STATES = _Kind(
    OwnState, _StateForm, 'OwnState("stretch", "z", "m", "meaning", size=3)', MAX_STATES
)


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
    nodes = list(_with_bases(class_name, classes))
    methods = [part.name for node in nodes for part in node.body if isinstance(part, _METHOD)]
    return Declared(
        _listed("gains", _GAINS, nodes),
        _mode_count(nodes),
        _listed("states", _STATES, nodes),
        "supplied" in methods,
    )


_METHOD = ast.FunctionDef | ast.AsyncFunctionDef


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


def _listed(attribute: str, kind: _Kind, nodes: Iterable[ast.ClassDef]) -> tuple[Any, ...]:
    """Return the declarations that a class assigns to an attribute."""
    node = _assigned(attribute, nodes)
    if node is None:
        return ()
    if not isinstance(node, ast.Tuple | ast.List):
        expected = f"expected ({kind.made.__name__}(...),)"
        raise DeclarationError(f"has {attribute} that are no tuple", expected, node.lineno)
    if len(node.elts) > kind.most:
        expected = f"expected at most {kind.most}"
        raise DeclarationError(f"has {len(node.elts)} {attribute}", expected, node.lineno)
    declarations = tuple(_declaration(entry, kind) for entry in node.elts)
    if len({declaration.name for declaration in declarations}) < len(declarations):
        raise DeclarationError(f"has two {attribute} of the same name", "", node.lineno)
    return declarations


def _declaration(node: ast.expr, kind: _Kind) -> Any:
    name, expected = kind.made.__name__, f"expected {kind.example}"
    if kind.made is Gain and isinstance(node, ast.Name) and node.id in _CONSTANTS:
        return _CONSTANTS[node.id]
    if not (isinstance(node, ast.Call) and _name_of(node.func) == name):
        problem = f"has an entry that cannot be read as {name} without running the file"
        raise DeclarationError(problem, expected, node.lineno)
    try:
        positional = [ast.literal_eval(argument) for argument in node.args]
        named = {word.arg or "**": ast.literal_eval(word.value) for word in node.keywords}
        made = kind.made(*positional, **named)
        kind.form.model_validate(made._asdict())
    except ValidationError as error:
        where, *_ = (*error.errors()[0]["loc"], "arguments")
        problem = f"has a {name} whose {where} is wrong: {error.errors()[0]['msg']}"
        raise DeclarationError(problem, expected, node.lineno) from error
    except (TypeError, ValueError, SyntaxError, MemoryError, RecursionError) as error:
        problem = f"has a {name}(...) whose arguments are not plain texts, numbers, True or False"
        raise DeclarationError(problem, expected, node.lineno) from error
    return made


def _mode_count(nodes: Iterable[ast.ClassDef]) -> int:
    node = _assigned("mode_count", nodes)
    if node is None:
        return 0
    value = node.value if isinstance(node, ast.Constant) else None
    if type(value) is not int or not 0 <= value <= MAX_MODES:
        expected = f"expected a whole number up to {MAX_MODES}"
        raise DeclarationError("has a mode_count that is no such number", expected, node.lineno)
    return value


def _assigned(name: str, nodes: Iterable[ast.ClassDef]) -> ast.expr | None:
    """Return the last value that the first of some classes that has a name assigns to it."""
    for node in nodes:
        value = None
        for part in node.body:
            targets: list[ast.expr] = [part.target] if isinstance(part, ast.AnnAssign) else []
            targets = part.targets if isinstance(part, ast.Assign) else targets
            if name in map(_name_of, targets):
                value = getattr(part, "value", None) or value
        if value is not None:
            return value
    return None


def _with_bases(
    class_name: str, classes: dict[str, ast.ClassDef], seen: tuple[str, ...] = ()
) -> Iterator[ast.ClassDef]:
    """Yield a class, and its bases that are in the same file, depth first."""
    if class_name in classes and class_name not in seen:
        yield classes[class_name]
        for base in classes[class_name].bases:
            yield from _with_bases(_name_of(base), classes, (*seen, class_name))


def _name_of(node: ast.expr) -> str:
    """Return the last part of a name such as `Gain` or `elements.Gain`; "" for anything else."""
    if isinstance(node, ast.Name):
        return node.id
    return node.attr if isinstance(node, ast.Attribute) else ""
