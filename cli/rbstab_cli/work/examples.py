"""`rbstab examples`: a list of the configs and plans that come with the program, or copies."""

from pathlib import Path

import click

from rbstab.files.text import quoted, shell_word
from rbstab.packaged.examples import (
    UnknownExampleError,
    described,
    examples_named,
    files_of,
    names,
    needs_code,
)
from rbstab_cli.output.files import write_new_files
from rbstab_cli.printing import Table, say


def examples(words: tuple[str, ...], output: Path, every: bool) -> None:
    """List the examples, or copy those that are named.

    Args:
        words: The names of examples or of folders of them, or the last parts of names.
        output: The folder of the copies.
        every: Whether to copy all examples.
    """
    if every or words:
        _copy(words, output)
        return
    table = Table("name", "kind", "title", words=("name", "kind"))
    for name in names():
        example = described(name)
        table.add(name, "plan" if example.is_plan else "config", example.title)
    table.print()
    say("Copy: rbstab examples NAME...")


def _copy(words: tuple[str, ...], output: Path) -> None:
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
    say(f"Next: rbstab {' '.join(following)}")
