"""The examples: configs and plans that come with the program, in a wheel and in a checkout."""

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

from rbstab.config.errors import closest, did_you_mean
from rbstab.config.load import source_of
from rbstab.sweep.plan.load import is_plan

SUFFIX = ".yaml"


class UnknownExampleError(LookupError):
    """There is no example of this name."""


class Example(NamedTuple):
    """A config or a plan that comes with the program.

    Attributes:
        name: The path below the folder of the examples, without suffix: `paper/case1_permanent`.
        path: The file.
        is_plan: Whether it is the plan of a sweep; otherwise it is a config.
        title: Its title.
    """

    name: str
    path: Path
    is_plan: bool
    title: str


def examples_folder() -> Path:
    """Return the folder of the examples.

    A wheel carries them inside the package. In a checkout they are beside the sources.
    """
    package = Path(__file__).parents[1]
    inside = package / "configs"
    return inside if inside.is_dir() else package.parents[1] / "configs"


def names() -> list[str]:
    """Return the names of all examples: those of the paper, then others, then plans."""
    folder = examples_folder()
    paths = sorted(folder.rglob(f"*{SUFFIX}"))
    relative_names = [path.relative_to(folder).with_suffix("").as_posix() for path in paths]
    return sorted(relative_names, key=lambda name: (not name.startswith("paper/"), name))


def example(name: str) -> Path:
    """Return the path of a config or plan that comes with rbstab, for `simulate` or `load_plan`.

    Args:
        name: The name, such as `paper/case1_permanent`; or its last part, `case1_permanent`.

    Raises:
        UnknownExampleError: There is no such example, or several end with this name.
    """
    matches = examples_named(name)
    if len(matches) != 1:
        raise UnknownExampleError(f"{name} names {len(matches)} examples: {', '.join(matches)}")
    return _path(matches[0])


def examples_named(word: str) -> list[str]:
    """Return the names of the examples that a word means.

    Args:
        word: A name, its last part, or a folder such as `paper`, which means all below it.

    Raises:
        UnknownExampleError: There is none.
    """
    every = names()
    wanted = word.removesuffix(SUFFIX).strip("/")
    matches = (
        [name for name in every if name == wanted]
        or [name for name in every if name.startswith(f"{wanted}/")]
        or [name for name in every if name.endswith(f"/{wanted}")]
    )
    if not matches:
        raise UnknownExampleError(f"there is no example {word}{_hint(wanted, every)}")
    return matches


def _hint(wanted: str, every: list[str]) -> str:
    """Return the end of a message: the examples that were likely meant."""
    last_parts = {name.rpartition("/")[2]: name for name in every}
    meant = [name for last, name in last_parts.items() if wanted and last.startswith(wanted)]
    if not meant:
        close = closest(wanted, [*every, *last_parts])
        meant = [] if close is None else [last_parts.get(close, close)]
    return f"; {did_you_mean(meant)}" if meant else ""


def described(name: str) -> Example:
    """Return an example with its title."""
    path = _path(name)
    return Example(name, path, is_plan(path), str(source_of(path).data.get("title", "untitled")))


def files_of(wanted: Iterable[str]) -> dict[Path, Path]:
    """Return the files that examples need: themselves, and all files that they name.

    So a plan comes with its base, and a config with its tables, and with the measured motion that
    has its name.

    Args:
        wanted: Names of examples.

    Returns:
        The files by their paths below the folder of the examples.
    """
    folder = examples_folder()
    files: dict[Path, Path] = {}
    waiting = [_path(name) for name in wanted]
    while waiting:
        path = waiting.pop()
        below = path.relative_to(folder)
        if below in files:
            continue
        files[below] = path
        if path.suffix == SUFFIX:
            waiting += _named_files(path, folder)
            motion = path.with_suffix(".csv")
            waiting += [motion] if motion.is_file() else []
    return dict(sorted(files.items()))


def needs_code(name: str) -> bool:
    """Return whether an example has elements in Python, which run only with `--allow-python`."""
    return any(below.suffix == ".py" for below in files_of([name]))


def _path(name: str) -> Path:
    return examples_folder() / f"{name}{SUFFIX}"


def _named_files(path: Path, folder: Path) -> list[Path]:
    """Return the files below a folder that the texts of a config or plan name."""
    files = []
    for text in _texts(source_of(path).data):
        file = (path.parent / text).resolve()
        if len(text) < 200 and file.is_file() and file.is_relative_to(folder.resolve()):
            files.append(folder / file.relative_to(folder.resolve()))
    return files


def _texts(value: Any) -> Iterator[str]:
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict | list):
        for entry in value.values() if isinstance(value, dict) else value:
            yield from _texts(entry)
