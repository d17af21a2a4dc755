"""`rbstab schema`."""

from rbstab_cli.options import declare


@declare("schema", "rbstab schema > rbstab.schema.json")
def command() -> None:
    """Print the JSON Schema of a config, for editors.

    Write it to a file: `rbstab schema > rbstab.schema.json`. If a config then starts with the line
    `# yaml-language-server: $schema=rbstab.schema.json`, the YAML extension of most editors
    completes and checks it.
    """
    from rbstab.config.schema import json_schema
    from rbstab_cli.printing import print_json

    print_json(json_schema())
