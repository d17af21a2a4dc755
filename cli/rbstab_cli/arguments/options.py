"""Options that are the same in several commands."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

Decorator = Callable[[Callable[..., Any]], Callable[..., Any]]

CHANGES = click.option(
    "--set",
    "changes",
    multiple=True,
    metavar="KEY=VALUE",
    help="Replace a value in every config: body.mass=50, controller.K_t[0]=5000. Repeatable.",
)
"""The option --set of commands that read configs."""

ALLOW_PYTHON = click.option(
    "--allow-python",
    is_flag=True,
    help="Run the Python files of elements with kind: python. They can do all that you can do, so "
    "read them first; without this option a config with one is refused.",
)
"""The option --allow-python of commands that build the equations of a config."""

AS_JSON = click.option("--json", "as_json", is_flag=True, help="Print the results as JSON.")
"""The option --json of commands that print their results as a table."""


def quiet_option(help_text: str) -> Decorator:
    """Return the option -q."""
    return click.option("-q", "--quiet", is_flag=True, help=help_text)


QUIET = quiet_option("Print no progress and no hints; problems are still printed.")
"""The option -q of commands that show their progress."""


def results_folder(example: str) -> Decorator:
    """Return the option -o of commands that store results in a folder.

    Args:
        example: The end of the help text: the file or folder that an input gives.
    """
    return click.option(
        "-o",
        "--output",
        default="results",
        show_default=True,
        metavar="DIR",
        type=click.Path(file_okay=False, path_type=Path),
        help=f"Folder of the results; {example}.",
    )


def output_file(help_text: str) -> Decorator:
    """Return the option -o of commands that write one text file; use it with `REPLACE_FILE`."""
    return click.option(
        "-o",
        "--output",
        metavar="FILE",
        type=click.Path(dir_okay=False, path_type=Path),
        help=help_text,
    )


REPLACE_FILE = click.option("--force", is_flag=True, help="Replace FILE if it exists.")
"""The option --force of commands that write one text file."""
