"""Protects the first files of a new user: valid for each variant, without a warning, each number
with its unit, and every command of their page works.
"""

import re
from pathlib import Path

import pytest
from click.testing import CliRunner
from support.printed_paths import words_of

from rbstab.config.load import load_config
from rbstab.config.schema import VARIANTS
from rbstab.config.units import unit_of
from rbstab.config.warnings import config_warnings
from rbstab.experiment.simulate import simulate
from rbstab.packaged.first_steps import first_files
from rbstab.sweep.plan.load import load_plan
from rbstab_cli.main import cli


@pytest.fixture(params=VARIANTS)
def folder(request, tmp_path, monkeypatch):
    """The files of a variant, in the working folder."""
    for name, text in first_files(request.param).items():
        (tmp_path / name).write_text(text)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_config_is_valid_and_runs(folder):
    config = load_config("experiment.yaml")
    assert config_warnings(config) == []
    result = simulate(load_config("experiment.yaml", ["integration.samples=101"]))
    assert result.status == "completed"
    assert result.attributes["verdict"] == "consistent"


def test_the_plan_varies_the_config(folder):
    plan = load_plan("sweep.yaml")
    assert plan.members == 15 * 15
    assert f"= {plan.members} members" in Path("sweep.yaml").read_text()


def test_each_number_has_its_unit(folder):
    section = ""
    for line in Path("experiment.yaml").read_text().splitlines():
        key, colon, rest = line.strip().lstrip("# ").partition(":")
        if line[:1].isalpha():
            section = key
        dotted = f"{section}.{key}" if line.startswith("  ") else key
        if colon and unit_of(dotted):
            assert rest.partition("# ")[2].startswith(unit_of(dotted)), line


def test_gravity_can_be_switched_on_as_the_comment_says(folder):
    text = Path("experiment.yaml").read_text()
    assert "\n# gravity: " in text
    Path("experiment.yaml").write_text(text.replace("\n# gravity: ", "\ngravity: "))
    assert load_config("experiment.yaml").gravity == (0, 0, -9.81)


@pytest.mark.heavy
def test_every_command_of_the_page_works(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    files = first_files("visco-elastic")
    for name, text in files.items():
        Path(name).write_text(text)
    commands = re.findall(r"^\$ rbstab (.*)$", files["README.md"], flags=re.MULTILINE)
    assert len(commands) == 14
    for line in commands:
        done = CliRunner().invoke(cli, words_of(line))
        assert done.exit_code == 0, f"{line}\n{done.output}"
    assert Path("results/sweep.html").is_file()
