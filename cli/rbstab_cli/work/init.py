"""`rbstab init`: the first files of a new user, or the template of an element."""

from pathlib import Path

import click

from rbstab.config.errors import hint
from rbstab.config.schema import VARIANTS
from rbstab.elements.user_code.template import TEMPLATE
from rbstab.files.text import chained_commands, shell_word
from rbstab.packaged.first_steps import CONFIG_FILE, first_files
from rbstab_cli.output.files import write_file, write_new_files
from rbstab_cli.printing import say


def init(folder: Path, variant: str, element: Path | None, force: bool) -> None:
    """Write the files, and name the next command.

    Args:
        folder: The folder of the config and the plan.
        variant: What acts at the contact point: one of `VARIANTS`.
        element: The file for the template of an element; then nothing else is written.
        force: Whether an existing template is replaced.
    """
    if element is not None:
        _write_element(element, force=force)
        return
    if variant not in VARIANTS:
        message = f"'{variant}' is not one of {', '.join(VARIANTS)}{hint(variant, VARIANTS)}"
        raise click.BadParameter(message, param_hint="'--variant'")
    texts = {name: text.encode() for name, text in first_files(variant).items()}
    write_new_files(folder, texts, elsewhere=f"rbstab init FOLDER --variant {variant}")
    following = f"rbstab run {CONFIG_FILE}"
    if folder != Path():
        following = chained_commands(f"cd {shell_word(folder)}", following)
    say(f"Next: {following}")


def _write_element(file: Path, *, force: bool) -> None:
    """Write the template of an element, which works as it is: the example of the documentation."""
    write_file(file, TEMPLATE, force=force)
    say(f"-> {file}")
    say(f"Next: rbstab check --element {shell_word(file)}")
    say(
        "In a config: elements: {mine: {kind: python, "
        f"file: {file.name}, class: CubicSpring, parameters: {{k: [1e5, 1e5, 2e5]}}}}}}"
    )
