"""`rbstab completion`."""

import click
from click.shell_completion import get_completion_class


@click.command("completion")
@click.argument("shell", type=click.Choice(["bash", "zsh", "fish"]))
def command(shell: str) -> None:
    """Print the completion script of a shell.

    Put `eval "$(rbstab completion bash)"` (or zsh) into the shell's start-up file; for fish,
    `rbstab completion fish | source`.
    """
    from rbstab_cli.main import cli

    completion = get_completion_class(shell)
    assert completion is not None  # the three choices are click's own
    click.echo(completion(cli, {}, "rbstab", "_RBSTAB_COMPLETE").source())
