"""The console of the library rich, which prints to a terminal or a pipe."""

from typing import NoReturn

from rich.console import Console

from rbstab_cli.streams import ReaderGoneError


class OutputConsole(Console):
    """A console on stdout or stderr."""

    def on_broken_pipe(self) -> NoReturn:
        """Leave the end of the process to `main`; rich would end it with exit code 1."""
        raise ReaderGoneError
