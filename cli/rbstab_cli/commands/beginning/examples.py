"""`rbstab examples`."""

from pathlib import Path

import click

from rbstab_cli import exit_codes


@click.command("examples")
@click.argument("names", nargs=-1, metavar="[NAME]...")
@click.option(
    "-o",
    "--output",
    default="configs",
    show_default=True,
    metavar="DIR",
    type=click.Path(file_okay=False, path_type=Path),
    help="Folder of the copies; paper/case1_permanent gives DIR/paper/case1_permanent.yaml.",
)
@click.option("--all", "every", is_flag=True, help="Copy all examples.")
def command(names: tuple[str, ...], output: Path, every: bool) -> None:
    """List the configs and plans that come with the program, or copy them.

    Without NAME: lists them. With NAME: copies them, each with the files that it needs, such as the
    base of a plan. NAME is paper/case1_permanent, or its last part, or a folder such as paper.
    Nothing is overwritten: if a file exists with other content, nothing is written.
    """
    if every and names:
        raise click.UsageError("--all cannot be combined with NAME")
    if every or names:
        _copy(names, output)
    else:
        _list()
    raise click.exceptions.Exit(exit_codes.OK)


def _list() -> None:
    from rbstab.packaged.examples import described, names
    from rbstab_cli.output.tables import add_row, new_table, print_table

    table = new_table("name", "kind", "title", words=("name", "kind"))
    for name in names():
        found = described(name)
        add_row(table, name, "plan" if found.is_plan else "config", found.title)
    print_table(table)
    click.echo("Copy: rbstab examples NAME...", err=True)


def _copy(words: tuple[str, ...], output: Path) -> None:
    from rbstab.files.shell_words import quoted, shell_word
    from rbstab.packaged.examples import (
        UnknownExampleError,
        described,
        examples_named,
        files_of,
        names,
        needs_code,
    )
    from rbstab_cli.output.new_files import write_new_files

    try:
        wanted = [name for word in words for name in examples_named(word)] if words else names()
    except UnknownExampleError as error:
        end = "" if str(error).endswith("?") else "."
        raise click.UsageError(f"{error}{end} `rbstab examples` lists them.") from error
    contents = {str(below): path.read_bytes() for below, path in files_of(wanted).items()}
    of = " ".join(map(quoted, words)) if words else "--all"
    write_new_files(output, contents, elsewhere=f"rbstab examples {of} -o FOLDER", keep_equal=True)
    first = described(wanted[0])
    following = ["sweep" if first.is_plan else "run", shell_word(output / f"{first.name}.yaml")]
    if needs_code(first.name):
        following.append("--allow-python")
    click.echo(f"Next: rbstab {' '.join(following)}", err=True)
