"""`rbstab init`."""

from pathlib import Path

import click

from rbstab_cli import exit_codes
from rbstab_cli.arguments.options import REPLACE_FILE

DEFAULT_ELEMENT = "cubic_spring.py"
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
@click.option(
    "--element",
    "element",
    is_flag=False,
    flag_value=DEFAULT_ELEMENT,
    metavar="[FILE]",
    type=click.Path(dir_okay=False, path_type=Path),
    help="Write only the template of an element of your own; default FILE: "
    f"{DEFAULT_ELEMENT} (docs/own_elements.md).",
)
@REPLACE_FILE
@click.pass_context
def command(
    context: click.Context, folder: Path, variant: str, element: Path | None, force: bool
) -> None:
    """Write a first config and a plan, or a template of an element of your own.

    DIR is the folder of the files, by default the current one; it is made if it is missing. The
    files are experiment.yaml, sweep.yaml and README.md. No such file is ever overwritten: if one of
    them exists, nothing is written.
    """
    if element is not None:
        _check_unused(context, "--element", {"DIR": "folder", "--variant": "variant"})
        _write_element(element, force=force)
        return
    _check_unused(context, "init without --element", {"--force": "force"})
    from rbstab.files.shell_words import one_after_the_other, shell_word
    from rbstab.packaged.first_steps import CONFIG_FILE, first_files
    from rbstab_cli.output.new_files import write_new_files

    chosen = "" if variant == DEFAULT_VARIANT else f" --variant {variant}"
    write_new_files(folder, first_files(variant), elsewhere=f"rbstab init FOLDER{chosen}")
    following = f"rbstab run {CONFIG_FILE}"
    if folder != Path():
        following = one_after_the_other(f"cd {shell_word(folder)}", following)
    click.echo(f"Next: {following}", err=True)
    raise click.exceptions.Exit(exit_codes.OK)


def _check_unused(context: click.Context, by: str, names: dict[str, str]) -> None:
    """Refuse arguments that would have no effect."""
    default = click.core.ParameterSource.DEFAULT
    for words, name in names.items():
        if context.get_parameter_source(name) is not default:
            raise click.UsageError(f"{by} has no use for {words}")


def _write_element(file: Path, *, force: bool) -> None:
    """Write the template of an element, which works as it is: the example of the documentation."""
    from rbstab.elements.user_code.template import TEMPLATE
    from rbstab.files.shell_words import shell_word
    from rbstab_cli.output.text_file import write_text

    write_text(file, TEMPLATE, force=force)
    click.echo(f"-> {file}", err=True)
    click.echo(f"Next: rbstab check --element {shell_word(file)}", err=True)
    click.echo(
        "In a config: elements: {mine: {kind: python, "
        f"file: {file.name}, class: CubicSpring, parameters: {{k: [1e5, 1e5, 2e5]}}}}}}",
        err=True,
    )
