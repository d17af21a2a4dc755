"""The commands to begin with: first files, examples, checks, the shell and the cache."""

import click
from click.shell_completion import get_completion_class

from rbstab_cli.options import FILE, FOLDER, PATH, declare, flag, output, repeatable, takes

DEFAULT_ELEMENT = "cubic_spring.py"


@declare(
    "init",
    "rbstab init my_experiment",
    "init:init",
    needs={"--force": "--element"},
    alone={"--element": ("--force",)},
)
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
def init() -> None:
    """Write a first config and a plan, or a template of an element of your own.

    Writes experiment.yaml, sweep.yaml and README.md into the folder DIR, by default the current
    one. If one of these files exists, nothing is written.
    """


@declare(
    "examples", "rbstab examples real_body", "examples:examples", excludes={"--all": ("NAME",)}
)
@click.argument("words", nargs=-1, metavar="[NAME]...")
@output(
    "Folder of the copies; paper/case1_permanent gives DIR/paper/case1_permanent.yaml.",
    FOLDER,
    "DIR",
    default="configs",
    show_default=True,
)
@flag("--all", "every", help="Copy all examples.")
def examples() -> None:
    """List the configs and plans that come with the program, or copy them.

    Without NAME: lists them. With NAME: copies it, with the files that it needs, such as the base
    of a plan. NAME is paper/case1_permanent, or its last part, or a folder such as paper. If a file
    exists with other content, nothing is written.
    """


@declare(
    "check",
    "rbstab check experiment.yaml sweep.yaml",
    "check:check",
    needs={"--set": "CONFIG", "--allow-python": "CONFIG"},
)
@click.argument("configs", nargs=-1, metavar="[CONFIG]...", type=PATH)
@repeatable(
    "--element",
    "elements",
    metavar="FILE",
    type=PATH,
    help="Run the Python file FILE, and test each of its element classes at random states. "
    "Repeatable.",
)
@takes("set", "allow_python")
def check() -> None:
    """Check configs and plans and list their errors, or test elements of your own.

    If all are valid, prints one line for each: the variant, coordinates, engine and run id of a
    config; the members, variants and id of a plan. Otherwise prints all errors as
    FILE:LINE:COLUMN: KEY: PROBLEM (EXPECTED); the exit code is 2.

    With --element, tests the methods of each class of FILE: kinds of number, power balance,
    dissipation (see docs/own_elements.md). If a test fails, the exit code is 2.
    """


@declare("cache", "rbstab cache --clear", "cache:cache")
@flag("--clear", help="Remove all code from the cache.")
def cache() -> None:
    """Show the cache of compiled code, or clear it.

    The engine heyoka, the default of sweeps, compiles the equations of a config once and keeps the
    code, up to 200 MB, in the cache folder of the user or in the folder HEYOKA_CACHE_DIR (an
    environment variable). Results do not depend on it.
    """


@declare("schema", "rbstab schema > rbstab.schema.json")
def schema() -> None:
    """Print the JSON Schema of a config, for editors.

    Write it to a file, as below. If a config then starts with the line
    `# yaml-language-server: $schema=rbstab.schema.json`, the YAML extension of most editors
    completes and checks it.
    """
    from rbstab.config.schema import json_schema
    from rbstab_cli.printing import print_json

    print_json(json_schema())


@declare("completion", "rbstab completion bash")
@click.argument("shell", type=click.Choice(["bash", "zsh", "fish"]))
@click.pass_context
def completion(ctx: click.Context, shell: str) -> None:
    """Print the completion script of a shell.

    Add the line `eval "$(rbstab completion bash)"` (or zsh) to the shell's start-up file. For fish,
    add `rbstab completion fish | source`.
    """
    completion = get_completion_class(shell)
    assert completion is not None  # click supports all three shells
    click.echo(completion(ctx.find_root().command, {}, "rbstab", "_RBSTAB_COMPLETE").source())
