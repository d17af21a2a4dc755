"""`rbstab upgrade`."""

import os
from collections.abc import Iterable
from pathlib import Path

import click

from rbstab_cli import exit_codes
from rbstab_cli.arguments.configs import exit_on_problems, problem_lines
from rbstab_cli.arguments.options import REPLACE_FILE, output_file

_FOR_PLANS = "a plan keeps its own schema_version 1, and its base may have 2"


@click.command("upgrade")
@click.argument(
    "configs", nargs=-1, required=True, metavar="CONFIG...", type=click.Path(path_type=Path)
)
@output_file("File of the new config, for a single CONFIG; default: CONFIG itself.")
@REPLACE_FILE
def command(configs: tuple[Path, ...], output: Path | None, force: bool) -> None:
    """Rewrite configs of schema version 1 as version 2.

    Only `schema_version` changes, or is added; comments, order, spacing and line ends stay. Version
    2 may have `elements`, and may leave `controller` out.

    Version 1 keeps working: upgrade a config when you want elements. Its run id then changes, so it
    is a different run, and a sweep of it is a different sweep: a stored one is not used for it, and
    not overwritten. Stored proofs are still used.

    Each CONFIG is replaced as a whole or not at all. If any CONFIG is wrong, all errors are printed
    as by `rbstab check`, and nothing is written; the exit code is 2.
    """
    targets = _targets(configs, output, force=force)
    texts = _upgraded(configs)
    for path, text in texts.items():
        if text is not None:
            _check_writable(targets[path], in_place=output is None, force=force)
    for path, text in texts.items():
        if text is None:
            written = "; nothing is written" if output else ""
            click.echo(f"{path}: schema_version 2 already, nothing to do{written}")
        else:
            _write(targets[path], text, in_place=output is None, force=force)
            copied = f", in {output}" if output else ""
            click.echo(f"{path}: schema_version 1 -> 2{copied}")


def _targets(configs: tuple[Path, ...], output: Path | None, *, force: bool) -> dict[Path, Path]:
    """Return the file that is written for each config.

    Raises:
        UsageError: The options do not fit the configs.
    """
    if output is None:
        if force:
            raise click.UsageError("--force has no effect without -o.")
        # A link stays a link: the file that it leads to is replaced.
        return {path: Path(os.path.realpath(path)) for path in configs}
    if len(set(configs)) > 1:
        raise click.UsageError("-o names one file, so it needs a single CONFIG.")
    if os.path.realpath(output) == os.path.realpath(configs[0]):
        raise click.UsageError(f"{output} is the given config. Without -o it is upgraded in place.")
    return {configs[0]: output}


def _upgraded(configs: Iterable[Path]) -> dict[Path, str | None]:
    """Return the new text of each config, None if it needs none; any problem ends the command."""
    from rbstab.config.errors import ConfigError
    from rbstab.config.writing.upgrade import upgraded_text

    texts: dict[Path, str | None] = {}
    problems: dict[str, None] = {}
    for path in configs:
        try:
            texts[path] = upgraded_text(path)
        except ConfigError as error:
            problems.update(dict.fromkeys(problem_lines(path, error, _FOR_PLANS)))
    exit_on_problems(problems)
    return texts


def _check_writable(target: Path, *, in_place: bool, force: bool) -> None:
    """End the command with exit code 4, before anything is written, if a file cannot be."""
    from rbstab_cli.output.text_file import check_target

    check_target(target, force=in_place or force)
    if in_place and not os.access(target, os.W_OK):
        click.echo(f"error: {target} cannot be written: it is write-protected", err=True)
        raise click.exceptions.Exit(exit_codes.STORAGE)


def _write(target: Path, text: str, *, in_place: bool, force: bool) -> None:
    from rbstab_cli.output.text_file import write_text

    write_text(target, text, force=in_place or force, keep_access=in_place)
