"""Protects the commands that pages show: bash, zsh, PowerShell and cmd all read them alike.

zsh of macOS takes brackets outside quotes as a pattern of file names, and cmd does not know single
quotes. Double quotes mean the same in all of them. rbstab itself
replaces patterns with a star where a shell does not.
"""

import re

import pytest
from support.page_sessions import ROOT, blocks, commands, pages

from rbstab.config.schema import VARIANTS
from rbstab.packaged.first_steps import first_files

SPECIAL = re.compile(r"[\[\](){};'`$&|?!^#@]")
"""Characters that some shell does not take as they are."""

SHARED = re.compile(r'"[^"$`\\%!]*"')
"""A text in double quotes that all shells read alike."""

SLURM = "sbatch "
"""A command of clusters, which have a bash."""


def unlike(command):
    """Return the characters of a command that the shells do not read alike."""
    return SPECIAL.findall(SHARED.sub("", command))


def shown_commands(text):
    consoles = [block for block in blocks(text) if block.language == "console"]
    return [command.words for block in consoles for command in commands(block)]


@pytest.mark.parametrize("page", pages())
def test_commands_of_pages(page):
    for command in shown_commands((ROOT / page).read_text(encoding="utf-8")):
        assert SLURM in command or not unlike(command)


@pytest.mark.parametrize("variant", VARIANTS)
def test_commands_of_the_first_page(variant):
    shown = shown_commands(first_files(variant)["README.md"])
    assert len(shown) > 10
    for command in shown:
        assert not unlike(command)
