"""How a command ends that cannot be done: what it says on stderr, and its exit code."""

import sys
from importlib.util import find_spec
from typing import IO, Any

import click

from rbstab_cli import exit_codes
from rbstab_cli.interrupts import interrupted_code
from rbstab_cli.printing import say


class Failed(click.ClickException):
    """The end of a command with an exit code, after lines that say why."""

    def __init__(self, code: int, *lines: str) -> None:
        super().__init__("\n".join(lines))
        self.lines = lines
        self.exit_code: int = code  # type: ignore[misc]

    def show(self, file: IO[Any] | None = None) -> None:
        """Print the lines."""
        for line in self.lines:
            say(line)


def require(extra: str, use: str, *modules: str) -> None:
    """End a command whose optional packages are not installed.

    Args:
        extra: The extra of rbstab that has them.
        use: What needs them.
        modules: The modules of the packages.

    Raises:
        UsageError: One of them is not installed.
    """
    for name in modules:
        if find_spec(name) is None:
            raise click.UsageError(
                f"{use} needs {name}, which a plain install lacks. Run: "
                f'pip install "rbstab[{extra}]"'
            )


CODES = {
    "OtherSweepError": exit_codes.USAGE,
    "StoreError": exit_codes.STORAGE,
    "CacheError": exit_codes.STORAGE,
    "EngineMissingError": exit_codes.USAGE,
    "FormatUnavailableError": exit_codes.USAGE,
    "TuningError": exit_codes.USAGE,
    "UnsuitedConfigError": exit_codes.USAGE,
    "UnfinishedRunError": exit_codes.NOT_COMPLETED,
}
"""The exit codes of the errors of the library. Their names are enough: none has to be imported."""


def told(error: Exception) -> Failed | None:
    """Return how the command ends with an error of the library; None: that is a fault in rbstab."""
    for kind in type(error).__mro__:
        if kind.__module__.startswith("rbstab.") and kind.__name__ in CODES:
            return Failed(CODES[kind.__name__], f"error: {error}")
    if _is_interrupt(error):
        return Failed(interrupted_code(), "Interrupted.")
    # Only where code of a user was loaded can an error be in it.
    loaded = sys.modules.get("rbstab.elements.user_code.loaded")
    failure = None if loaded is None else loaded.failure_in_user_code(error)
    return None if failure is None else Failed(exit_codes.USAGE, f"error: {failure}")


def _is_interrupt(error: BaseException | None) -> bool:
    """Return whether an interrupt became an error: Python does that where a class is made."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None


def reason_of(error: Exception) -> str:
    """Return what the system says of an error, or else its text."""
    return getattr(error, "strerror", None) or str(error)
