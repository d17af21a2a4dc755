"""`rbstab completion`."""

import click
from click.shell_completion import get_completion_class

from rbstab_cli.options import declare


@declare("completion", "rbstab completion bash")
@click.argument("shell", type=click.Choice(["bash", "zsh", "fish"]))
@click.pass_context
def command(ctx: click.Context, shell: str) -> None:
    """Print the completion script of a shell.

    Add the line `eval "$(rbstab completion bash)"` (or zsh) to the shell's start-up file. For fish,
    add `rbstab completion fish | source`.
    """
    completion = get_completion_class(shell)
    assert completion is not None  # click supports all three shells
    click.echo(completion(ctx.find_root().command, {}, "rbstab", "_RBSTAB_COMPLETE").source())
