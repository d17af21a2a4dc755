"""Warnings on stderr: those of results, and on stored proofs that cannot be read."""

from collections.abc import Iterable, Sequence
from pathlib import Path

from rbstab.config.schema import Config
from rbstab.config.warnings import config_warnings
from rbstab.experiment.proof_cache import why_unreadable
from rbstab.store.result import Result
from rbstab_cli.printing import say


def own_warnings(result: Result, config: Config) -> list[str]:
    """Return the warnings of a result, without those about its config.

    A command that reads a config prints the warnings about it at once.
    """
    of_config = config_warnings(config)
    stored = str(result.attributes.get("warnings", "")).splitlines()
    return [warning for warning in stored if warning not in of_config]


def print_result_warnings(path: Path, warnings: Sequence[str]) -> None:
    """Print the warnings of the result in a file."""
    for warning in warnings:
        say(f"warning: {path}: {warning}")


def print_unread_proofs(folders: Iterable[Path]) -> None:
    """Print for each folder of results why its proofs cannot be read; nothing if they can be."""
    for folder in dict.fromkeys(folders):
        reason = why_unreadable(folder)
        if reason:
            say(f"warning: {reason}. The results are shown without them.")
