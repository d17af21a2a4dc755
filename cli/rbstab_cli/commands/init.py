"""`rbstab init`."""

from typing import Any

import click

from rbstab_cli.options import FILE, FOLDER, declare, takes

DEFAULT_ELEMENT = "cubic_spring.py"


@declare("init", "rbstab init my_experiment")
@click.argument("folder", default=".", metavar="[DIR]", type=FOLDER)
@click.option(
    "--variant",
    default="visco-elastic",
    show_default=True,
    metavar="NAME",
    help="What acts at the contact point: free (nothing), permanent (it is held), visco-elastic, "
    "embedded or sliding.",
)
@click.option(
    "--element",
    is_flag=False,
    flag_value=DEFAULT_ELEMENT,
    metavar="[FILE]",
    type=FILE,
    help="Write only the template of an element of your own; default FILE: "
    f"{DEFAULT_ELEMENT} (docs/own_elements.md).",
)
@takes("force")
@click.pass_context
def command(context: click.Context, /, **given: Any) -> None:
    """Write a first config and a plan, or a template of an element of your own.

    DIR is the folder of the files, by default the current one; it is made if it is missing. The
    files are experiment.yaml, sweep.yaml and README.md. No such file is ever overwritten: if one of
    them exists, nothing is written.
    """
    from rbstab_cli.work.init import init

    init(context, **given)
