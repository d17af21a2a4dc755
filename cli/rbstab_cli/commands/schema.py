"""`rbstab schema`."""

import click


@click.command("schema")
def command() -> None:
    """Print the JSON Schema of a config, for editors.

    With the YAML extension of most editors, a first line
    `# yaml-language-server: $schema=rbstab.schema.json` completes and checks a config after
    `rbstab schema > rbstab.schema.json`.
    """
    from rbstab.config.schema import json_schema
    from rbstab_cli.output.json_output import print_json

    print_json(json_schema())
