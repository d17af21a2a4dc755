"""The option --engine, which replaces the engine of configs."""

from collections.abc import Iterable

import click


def refuse_engine_change(changes: Iterable[str]) -> None:
    """Refuse a change of the engine by --set beside --engine, which replaces it.

    Raises:
        UsageError: A change sets the engine.
    """
    if any(text.partition("=")[0] == "integration.engine" for text in changes):
        raise click.UsageError("--set integration.engine has no effect here. Use only --engine.")
