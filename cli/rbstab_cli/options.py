"""The arguments and options of commands: each that several have is declared once, by its name."""

from collections.abc import Callable
from functools import partial, wraps
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

import click

from rbstab.processes.imports import keep_imports
from rbstab_cli.command import Command
from rbstab_cli.printing import QUIET

Decorator = Callable[[Callable[..., Any]], Callable[..., Any]]


class PathType(click.Path):
    """`click.Path` without the empty one, usually a variable of a shell that has no value.

    `pathlib` would take it for the working folder.
    """

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the path.

        Args:
            value: The path as it was given.
            param: The option or argument, for the error.
            ctx: The context of the command, for the error.

        Raises:
            BadParameter: It is empty, or of another kind.
        """
        if value == "":
            self.fail("it is empty; expected a path.", param, ctx)
        return super().convert(value, param, ctx)


PATH = PathType(path_type=Path)
FOLDER = PathType(file_okay=False, path_type=Path)
FILE = PathType(dir_okay=False, path_type=Path)

flag = partial(click.option, is_flag=True)
repeatable = partial(click.option, multiple=True)


def declare(name: str, example: str, body: str = "", **rules: Any) -> Callable[..., Command]:
    """Declare a command by a function with its options and its help.

    Args:
        name: Its name.
        example: A command line that can be typed as it is, for the end of the help.
        body: The module below `work` and the function in it that does the work with the parameters;
            it is imported when the command is called, and returns the exit code if it is not 0.
            Without it the declared function does the work.
        rules: Options that need or exclude others; see `Command`.
    """

    def decorate(declared: Callable[..., Any]) -> Command:
        @wraps(declared)
        def call(**given: Any) -> Any:
            with keep_imports():
                work = resolve_name(f"rbstab_cli.work.{body}") if body else declared
            return work(**given)

        # click leaves the line after \b as it is.
        end = f"\b\nExample:\n  {example}"
        return click.command(name, cls=Command, epilog=end, **rules)(call)

    return decorate


class Choice(click.Choice[str]):
    """`click.Choice` whose message says which word was likely meant."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Return the word.

        Args:
            value: The word as it was given.
            param: The option or argument, for the error.
            ctx: The context of the command, for the error.

        Raises:
            BadParameter: It is none of the words.
        """
        try:
            return super().convert(value, param, ctx)
        except click.BadParameter as error:
            from rbstab.config.errors import closest

            close = closest(str(value), self.choices)
            hint = "" if close is None else f" Did you mean {close}?"
            raise click.BadParameter(f"{error.message}{hint}", ctx, param) from error


def quiet(
    help_text: str = "Print no progress and no hints; problems are still printed.",
) -> Decorator:
    """Return the option -q. `is_quiet` tells whether it is given; no function takes it."""

    def keep(ctx: click.Context, _: click.Parameter, value: bool) -> None:
        ctx.meta[QUIET] = value

    return flag("-q", "--quiet", help=help_text, expose_value=False, callback=keep)


SHARED: dict[str, Decorator] = {
    "config": click.argument("config", metavar="CONFIG", type=PATH),
    "configs": click.argument("configs", nargs=-1, required=True, metavar="CONFIG...", type=PATH),
    "results": click.argument(
        "results", nargs=-1, default=("results",), metavar="[RESULT]...", type=PATH
    ),
    "set": repeatable(
        "--set",
        "changes",
        metavar="KEY=VALUE",
        help="Replace a value in every config: body.mass=50, controller.K_t[0]=5000. Repeatable.",
    ),
    "allow_python": flag(
        "--allow-python",
        help="Run the Python files of elements with kind: python. They can do all that you can do, "
        "so read them first.",
    ),
    "json": flag("--json", "as_json", help="Print the results as JSON."),
    "quiet": quiet(),
    "force": flag("--force", help="Replace FILE if it exists."),
}
"""The arguments and options that several commands have."""


def takes(*names: str) -> Decorator:
    """Give a command arguments and options of `SHARED`, in this order."""

    def decorate(function: Callable[..., Any]) -> Callable[..., Any]:
        for name in reversed(names):
            function = SHARED[name](function)
        return function

    return decorate


def output(help_text: str, kind: PathType = FILE, metavar: str = "FILE", **more: Any) -> Decorator:
    """Return the option -o of commands that write a file, or into a folder.

    Args:
        help_text: What the help says of the file or folder.
        kind: The type of the path: `FILE`, `FOLDER` or `PATH`.
        metavar: What the help shows for the path.
        **more: Further arguments of `click.option`, such as a default.
    """
    return click.option("-o", "--output", metavar=metavar, type=kind, help=help_text, **more)


def results_folder(example: str, *names: str) -> Decorator:
    """Return the option of the folder of results, -o unless it has other names.

    Args:
        example: The end of the help text: the file or folder that an input gives.
        names: Other spellings of the option.
    """
    return click.option(
        *(names or ("-o", "--output")),
        default="results",
        show_default=True,
        metavar="DIR",
        type=FOLDER,
        help=f"Folder of the results; {example}.",
    )


def engine(default: str) -> Decorator:
    """Return the option --engine."""
    names = Choice(["heyoka", "scipy"])
    return click.option("--engine", type=names, help=f"Integrator; default: {default}.")
