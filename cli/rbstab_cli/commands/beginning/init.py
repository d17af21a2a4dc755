"""`rbstab init`."""

from pathlib import Path

import click

from rbstab_cli import exit_codes

DEFAULT_VARIANT = "visco-elastic"


def _known_variant(context: click.Context, _parameter: click.Parameter, name: str) -> str:
    """Check the name of a variant."""
    from rbstab.config.errors import closest
    from rbstab.config.schema import VARIANTS

    if name not in VARIANTS and not context.resilient_parsing:
        close = closest(name, VARIANTS)
        hint = f" Did you mean {close}?" if close is not None else ""
        raise click.BadParameter(f"'{name}' is not one of {', '.join(VARIANTS)}.{hint}")
    return name


@click.command("init")
@click.argument(
    "folder", default=".", metavar="[DIR]", type=click.Path(file_okay=False, path_type=Path)
)
@click.option(
    "--variant",
    default=DEFAULT_VARIANT,
    show_default=True,
    metavar="NAME",
    callback=_known_variant,
    help="What acts at the contact point: free (nothing), permanent (it is held), visco-elastic, "
    "embedded or sliding.",
)
def command(folder: Path, variant: str) -> None:
    """Write a first config, a plan, and what to try with them.

    DIR is the folder of the files, by default the current one; it is made if it is missing. The
    files are experiment.yaml, sweep.yaml and README.md. No file is ever overwritten: if one of them
    exists, nothing is written.
    """
    from rbstab.files.shell_words import shell_word
    from rbstab.packaged.first_steps import CONFIG_FILE, first_files
    from rbstab_cli.output.new_files import write_new_files

    write_new_files(folder, first_files(variant))
    go = "" if folder == Path() else f"cd {shell_word(folder)} && "
    click.echo(f"Next: {go}rbstab run {CONFIG_FILE}", err=True)
    raise click.exceptions.Exit(exit_codes.OK)
