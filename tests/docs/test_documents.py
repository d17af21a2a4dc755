"""Protects the documentation: every array, status, key, command and option is described, and links
work. `test_pages_run.py` compares what the pages show with what is printed.
"""

import re
import runpy
import tomllib

import click
import pytest
from support.documents import ROOT
from support.page_sessions import pages

from rbstab.config.schema import VARIANTS, model_of
from rbstab.elements.registry import GAINS, OWN_STATES
from rbstab.integrate.status import RunStatus
from rbstab_cli.main import cli
from rbstab_cli.registry import COMMANDS


def read(name):
    return (ROOT / name).read_text()


def test_the_tables_of_arrays_are_those_of_the_program():
    page, tables = read("results/README.md"), runpy.run_path(str(ROOT / "docs/quantity_tables.py"))
    assert tables["filled"](page) == page
    for kind in ("quantities", "columns", "traces"):
        assert tables["table"](kind) in page


@pytest.mark.parametrize("gain", GAINS.values(), ids=lambda gain: gain.name)
def test_each_gain_is_in_the_notation_with_its_unit(gain):
    assert f"| `{gain.name}` | {gain.unit} |" in read("docs/notation.md")


@pytest.mark.parametrize("state", OWN_STATES.values(), ids=lambda state: state.name)
def test_each_own_state_is_in_the_notation_with_its_unit(state):
    assert f"| `{state.name}` | {state.unit} |" in read("docs/notation.md")


@pytest.mark.parametrize("status", RunStatus)
def test_each_status_is_described(status):
    assert f"| `{status}` |" in read("results/README.md")


def test_each_key_of_a_config_is_described():
    for model in map(model_of, VARIANTS):
        for name, section in model.model_fields.items():
            if name in ("schema_version", "title"):
                continue
            assert f"`{name}" in read("docs/configs.md")
            annotation = section.annotation
            for key in getattr(annotation, "model_fields", {}):
                assert key in read("docs/configs.md"), key


def test_each_command_is_in_the_readme():
    for name in COMMANDS:
        assert f"rbstab {name}" in read("README.md")


def test_pages_print_the_version_of_today():
    project = tomllib.loads(read("pyproject.toml"))["project"]
    printed = [
        version
        for page in pages()
        for version in re.findall(r"^\$ rbstab --version\nrbstab (\S+)$", read(page), re.MULTILINE)
    ]
    assert printed == [project["version"]]


def test_each_option_of_a_report_is_described():
    command = cli.get_command(click.Context(cli), "report")
    assert command is not None
    for parameter in command.params:
        if isinstance(parameter, click.Option):
            assert f"`{parameter.opts[0]}" in read("docs/reports.md")


def test_relative_links_lead_somewhere():
    for page in (*ROOT.glob("*.md"), *ROOT.glob("docs/*.md"), ROOT / "results/README.md"):
        for target in re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", page.read_text()):
            assert (page.parent / target).exists(), f"{page.name}: {target}"
