"""`rbstab init`."""

from pathlib import Path

import click

from rbstab_cli.arguments.options import REPLACE_FILE

DEFAULT = "cubic_spring.py"


@click.command("init")
@click.option(
    "--element",
    "file",
    required=True,
    is_flag=False,
    flag_value=DEFAULT,
    metavar="[FILE]",
    type=click.Path(dir_okay=False, path_type=Path),
    help=f"Write the template of an element of your own; default FILE: {DEFAULT}.",
)
@REPLACE_FILE
def command(file: Path, force: bool) -> None:
    """Write a template to start from.

    The template of an element works as it is; it is the example of docs/own_elements.md.
    """
    from rbstab.elements.user_code.template import TEMPLATE
    from rbstab_cli.output.text_file import write_text

    write_text(file, TEMPLATE, force=force)
    click.echo(f"-> {file}", err=True)
    click.echo(f"Next: rbstab check --element {file}", err=True)
    click.echo(
        "In a config: elements: {mine: {kind: python, "
        f"file: {file.name}, class: CubicSpring, parameters: {{k: [1e5, 1e5, 2e5]}}}}}}",
        err=True,
    )
