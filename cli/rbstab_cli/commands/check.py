"""`rbstab check`."""

from pathlib import Path

import click

from rbstab_cli.arguments.configs import load_all
from rbstab_cli.arguments.options import CHANGES


@click.command("check")
@click.argument(
    "configs", nargs=-1, required=True, metavar="CONFIG...", type=click.Path(path_type=Path)
)
@CHANGES
def command(configs: tuple[Path, ...], changes: tuple[str, ...]) -> None:
    """Check configs and list their errors.

    If every CONFIG is valid, prints one line for each: variant, coordinates, engine and run id.
    Otherwise prints all errors as FILE:LINE:COLUMN: KEY: PROBLEM (EXPECTED); the exit code is 2.
    """
    from rbstab.config.load import run_id

    for path, config in load_all(configs, changes).items():
        variant, integration = config.controller.variant, config.integration
        click.echo(
            f"{path}: valid: {variant}, coordinates {integration.coordinates}, "
            f"engine {integration.engine}, run id {run_id(config)}"
        )
