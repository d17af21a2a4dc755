"""Protects the rule for docstrings: private ones are a line, public ones describe arguments.

What a command does takes its options, and their help says what they mean: it need not say it again.
"""

import ast
from collections import defaultdict

from support.documents import ROOT

TREES = (ROOT / "src/rbstab", ROOT / "cli/rbstab_cli")

LONGEST = 100

MANY = 3

DEFINITIONS = ast.FunctionDef | ast.ClassDef

ALL_WRONG = '''
def _root(x):
    """Return the root of x.

    Newton's method finds it.
    """

def _length(x):
    """Return {long}."""

class _Table:
    """A table."""

    def add(self, row):
        """Add a row.

        It is the last one.
        """

def solved(x):
    """Return a solution."""
    def step(x):
        """Return the next x.

        It is nearer.
        """

def rotated(vector, axis, *, angle):
    """Return a rotated vector."""

class Mass:
    """A mass that is no spring."""

    def force(self, place, velocity, time):
        """Return the force; Args: as in a spring."""
'''.replace("{long}", "x" * LONGEST)

ALL_RIGHT = '''
def _root(x):
    """Return the root of x."""

def _nameless(x, y, z):
    pass

def scaled(x, factor):
    """Return x times a factor.

    It may be negative.
    """

def rotated(vector, axis, *, angle):
    """Return a rotated vector.

    Args:
        vector: Shape (3,), m.
        axis: Shape (3,), of unit length.
        angle: rad.
    """

class Element:
    """An element."""

    def force(self, place, velocity, time):
        """Return the force, N.

        Args:
            place: m.
            velocity: m/s.
            time: s.
        """

    def energy(self, place, velocity):
        """Return the energy, J."""

class Tie(Element):
    """An element that ties."""

class Spring(Tie):
    """A spring."""

    def force(self, place, velocity, time):
        """Return -k times the place."""
'''


def describes_arguments(definition):
    """Return whether a docstring has a section Args."""
    return "Args:" in (ast.get_docstring(definition) or "").splitlines()


def bases_of(owner, classes):
    """Yield the bases of a class in the program, and their bases."""
    for base in owner.bases:
        name = base.value if isinstance(base, ast.Subscript) else base
        for candidate in classes[getattr(name, "id", "")]:
            yield candidate
            yield from bases_of(candidate, classes)


def has_described_base(function, owner, classes):
    """Return whether a method overrides one whose docstring describes the arguments."""
    bases = () if owner is None else bases_of(owner, classes)
    return any(
        getattr(member, "name", "") == function.name and describes_arguments(member)
        for base in bases
        for member in base.body
    )


def definitions_in(node, owner=None, *, private=False):
    """Yield functions and classes, each with its class and whether it is private.

    What a private class, or a function, has inside is private too.
    """
    for child in ast.iter_child_nodes(node):
        if not isinstance(child, DEFINITIONS):
            if not isinstance(child, ast.expr):
                yield from definitions_in(child, owner, private=private)
            continue
        is_private = private or (child.name.startswith("_") and not child.name.startswith("__"))
        yield child, owner, is_private
        is_class = isinstance(child, ast.ClassDef)
        inner = child if is_class else None
        yield from definitions_in(child, inner, private=is_private or not is_class)


def breaches(texts):
    """Return where the sources of a program break the rule.

    Args:
        texts: The sources by their names.
    """
    definitions = [
        (name, *definition)
        for name, text in texts.items()
        for definition in definitions_in(ast.parse(text))
    ]
    classes, wrong = defaultdict(list), []
    for _, definition, _, _ in definitions:
        if isinstance(definition, ast.ClassDef):
            classes[definition.name].append(definition)
    for name, definition, owner, private in definitions:
        docstring = ast.get_docstring(definition)
        where = f"{name}:{definition.lineno}: {definition.name}"
        if docstring is None:
            continue
        if private:
            if "\n" in docstring or len(docstring) > LONGEST:
                wrong.append(f"{where} is private and has more than a line")
        elif not isinstance(definition, ast.ClassDef):
            given = definition.args
            arguments = [*given.posonlyargs, *given.args, *given.kwonlyargs]
            count = len([a for a in arguments if a.arg not in {"self", "cls"}])
            described = describes_arguments(definition)
            is_work = name.startswith("cli/rbstab_cli/work/")
            if count >= MANY and not (
                is_work or described or has_described_base(definition, owner, classes)
            ):
                wrong.append(f"{where} has {count} arguments and no Args")
    return wrong


def test_private_docstrings_are_a_line_and_public_ones_describe_three_arguments():
    paths = [path for tree in TREES for path in sorted(tree.rglob("*.py"))]
    texts = {str(path.relative_to(ROOT)): path.read_text(encoding="utf-8") for path in paths}
    assert breaches(texts) == []


def test_each_breach_of_the_rule_is_seen_and_nothing_else():
    names = [line.split(": ")[1].split()[0] for line in breaches({"wrong.py": ALL_WRONG})]
    assert names == ["_root", "_length", "add", "step", "rotated", "force"]
    assert breaches({"right.py": ALL_RIGHT}) == []
