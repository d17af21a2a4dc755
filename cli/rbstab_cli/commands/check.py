"""`rbstab check`."""

from pathlib import Path

import click

from rbstab_cli.arguments.configs import CHANGES, load_all


@click.command("check")
@click.argument(
    "configs", nargs=-1, required=True, metavar="CONFIG...", type=click.Path(path_type=Path)
)
@CHANGES
def command(configs: tuple[Path, ...], changes: tuple[str, ...]) -> None:
    """Say whether configs are right, and what is wrong with them.

    Prints one line for each right CONFIG: its variant, its coordinates, its engine and its run id.
    If one is wrong, prints all errors as FILE:LINE:COLUMN: KEY: PROBLEM (EXPECTED) and ends with
    exit code 2.
    """
    from rbstab.config.load import run_id

    for path, config in load_all(configs, changes).items():
        variant, integration = config.controller.variant, config.integration
        click.echo(
            f"{path}: right: {variant}, coordinates {integration.coordinates}, "
            f"engine {integration.engine}, run id {run_id(config)}"
        )
