"""`rbstab completion`."""

import click
from click.shell_completion import get_completion_class


@click.command("completion")
@click.argument("shell", type=click.Choice(["bash", "zsh", "fish"]))
@click.pass_context
def command(ctx: click.Context, shell: str) -> None:
    """Print the completion script of a shell.

    Put `eval "$(rbstab completion bash)"` (or zsh) into the shell's start-up file; for fish,
    `rbstab completion fish | source`.
    """
    completion = get_completion_class(shell)
    assert completion is not None  # click knows all three choices
    click.echo(completion(ctx.find_root().command, {}, "rbstab", "_RBSTAB_COMPLETE").source())
