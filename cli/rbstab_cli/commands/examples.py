"""`rbstab examples`."""

from typing import Any

import click

from rbstab_cli.options import FOLDER, declare, flag, output


@declare("examples", "rbstab examples real_body")
@click.argument("words", nargs=-1, metavar="[NAME]...")
@output(
    "Folder of the copies; paper/case1_permanent gives DIR/paper/case1_permanent.yaml.",
    FOLDER,
    "DIR",
    default="configs",
    show_default=True,
)
@flag("--all", "every", help="Copy all examples.")
def command(**given: Any) -> None:
    """List the configs and plans that come with the program, or copy them.

    Without NAME: lists them. With NAME: copies them, each with the files that it needs, such as the
    base of a plan. NAME is paper/case1_permanent, or its last part, or a folder such as paper.
    Nothing is overwritten: if a file exists with other content, nothing is written.
    """
    from rbstab_cli.work.examples import examples

    examples(**given)
