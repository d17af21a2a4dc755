"""Sphinx directive `commands`: the reference of the command line, from the commands themselves."""

import re
from typing import Any

import click
from docutils import nodes
from docutils.parsers.rst import Directive

from rbstab_cli.main import cli

CODE = re.compile(r"`([^`]*)`|(?<![\w-])(--[a-z-]+)")


class Commands(Directive):
    """One section for each command: what it does, its arguments, its options and its defaults."""

    def run(self) -> list[nodes.Node]:
        """Return the sections, in the order of `rbstab --help`."""
        context = click.Context(cli, info_name="rbstab")
        return [
            self._section(name, command)
            for name in cli.list_commands(context)
            if (command := cli.get_command(context, name)) is not None
        ]

    def _section(self, name: str, command: click.Command) -> nodes.section:
        context = click.Context(command, info_name=f"rbstab {name}")
        section = nodes.section(ids=[f"rbstab-{name}"], names=[f"rbstab {name}"])
        section += nodes.title(text=f"rbstab {name}")
        usage = " ".join([context.command_path, *command.collect_usage_pieces(context)])
        section += nodes.literal_block(usage, usage, language="text")
        for paragraph in (command.help or "").replace("\b\n", "").split("\n\n"):
            section += _paragraph(paragraph)
        rows = [
            record
            for parameter in command.get_params(context)
            if (record := parameter.get_help_record(context)) is not None
        ]
        options = nodes.definition_list(classes=["options"])
        for heads, words in rows:
            term = nodes.term()
            term += nodes.literal(heads, heads)
            meaning = nodes.definition()
            meaning += _paragraph(words)
            item = nodes.definition_list_item()
            item += [term, meaning]
            options += item
        section += options
        example = (command.epilog or "").rpartition("\n")[2].strip()
        section += nodes.literal_block(example, example, language="text")
        return section


def _paragraph(words: str) -> nodes.paragraph:
    """Return a paragraph; what stands between backticks, and each option, is code."""
    paragraph, end = nodes.paragraph(), 0
    words = " ".join(words.split())
    for found in CODE.finditer(words):
        code = found[1] or found[2]
        paragraph += [nodes.Text(words[end : found.start()]), nodes.literal(code, code)]
        end = found.end()
    paragraph += nodes.Text(words[end:])
    return paragraph


def setup(app: Any) -> dict[str, bool]:
    """Register the directive."""
    app.add_directive("commands", Commands)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
