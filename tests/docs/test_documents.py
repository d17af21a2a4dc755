"""Protects the documentation: every array, status, key, command and option is described, links
work, and the README shows what the program prints.
"""

import re
from collections.abc import Iterable
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

from rbstab.config.schema import VARIANTS
from rbstab.elements.declarations import Gain, OwnState
from rbstab.elements.registry import GAINS, OWN_STATES
from rbstab.integrate.status import RunStatus
from rbstab.sweep.members.outcome import COLUMNS
from rbstab.systems.quantities import QUANTITIES, Quantity
from rbstab_cli.main import COMMANDS, cli

ROOT = Path(__file__).parents[2]


def read(name: str) -> str:
    return (ROOT / name).read_text()


@pytest.mark.parametrize("quantity", QUANTITIES, ids=lambda q: q.name)
def test_each_array_is_described_with_its_dimensions_and_unit(quantity: Quantity) -> None:
    dimensions = ", ".join(quantity.dimensions) or "-"
    row = f"| `{quantity.name}` | {dimensions} | {quantity.unit} |"
    assert row in read("results/README.md")
    assert f"`{quantity.name}`" in read("docs/notation.md")


@pytest.mark.parametrize("gain", GAINS.values(), ids=lambda gain: gain.name)
def test_each_gain_is_in_the_notation_with_its_unit(gain: Gain) -> None:
    assert f"| `{gain.name}` | {gain.unit} |" in read("docs/notation.md")


@pytest.mark.parametrize("state", OWN_STATES.values(), ids=lambda state: state.name)
def test_each_own_state_is_in_the_notation_with_its_unit(state: OwnState) -> None:
    assert f"| `{state.name}` | {state.unit} |" in read("docs/notation.md")


@pytest.mark.parametrize("status", RunStatus)
def test_each_status_is_described(status: RunStatus) -> None:
    assert f"| `{status}` |" in read("results/README.md")


def test_each_key_of_a_config_is_in_the_readme() -> None:
    for model in VARIANTS.values():
        for name, section in model.model_fields.items():
            if name in ("schema_version", "title"):
                continue
            assert f"`{name}" in read("README.md")
            annotation = section.annotation
            for key in getattr(annotation, "model_fields", {}):
                assert key in read("README.md"), key


def test_each_command_is_in_the_readme() -> None:
    for name in COMMANDS:
        assert f"rbstab {name}" in read("README.md")


def test_each_option_of_a_report_is_described() -> None:
    command = cli.get_command(click.Context(cli), "report")
    assert command is not None
    for parameter in command.params:
        if isinstance(parameter, click.Option):
            assert f"`{parameter.opts[0]}" in read("docs/reports.md")


def test_relative_links_lead_somewhere() -> None:
    for page in (*ROOT.glob("*.md"), *ROOT.glob("docs/*.md"), ROOT / "results/README.md"):
        for target in re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", page.read_text()):
            assert (page.parent / target).exists(), f"{page.name}: {target}"


def blocks(page: str) -> list[str]:
    return re.findall(r"```text\n(.*?)```", page, flags=re.DOTALL)


def without_time(text: str) -> list[list[str]]:
    """Return the words of each line, without wall times and without the widths of enclosures."""
    text = re.sub(r" ± \S+ J|, [0-9.]+ s(?=\.?$)", "", text.strip(), flags=re.MULTILINE)
    lines = [line.split() for line in text.splitlines()]
    return [words[:-1] if words[:1] and words[0].endswith(".h5") else words for words in lines]


@pytest.mark.slow
def test_the_readme_shows_what_the_program_prints(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    table, shown, stability, _ = blocks(read("README.md"))
    monkeypatch.chdir(tmp_path)
    cases = sorted(str(path) for path in (ROOT / "configs/paper").glob("*.yaml"))
    ran = CliRunner().invoke(cli, ["run", "--prove", *cases])
    show = CliRunner().invoke(cli, ["show", "results/case2_visco_elastic.h5"])
    assert without_round_off(without_time(ran.stdout)) == without_round_off(without_time(table))
    expected = shown.strip().splitlines()
    found = show.stdout.strip().splitlines()[: len(expected)]
    both = [without_time("\n".join(lines)) for lines in (found, expected)]
    assert without_round_off(both[0]) == without_round_off(both[1])
    case, weak = "configs/paper/case1_permanent.yaml", "controller.K_r=[40,40,32]"
    monkeypatch.chdir(ROOT)
    options = ["--set", weak, "--results", str(tmp_path / "results"), "--no-run"]
    printed = CliRunner().invoke(cli, ["stability", case, *options]).stdout.strip()
    # The verdict belongs to the run, and `--no-run` skips the run.
    expected = [line for line in stability.strip().splitlines() if "Verdict" not in line]
    assert without_time(printed) == without_time("\n".join(expected))


def without_round_off(lines: Iterable[list[str]]) -> list[list[str]]:
    """Return the words without round-off errors and their times, which differ by processor."""
    kept = []
    for words in lines:
        kept.append([word for word in words if not re.fullmatch(r"\d(\.\d+)?e-1\d", word)])
        if words[:1] in (["audit"], ["derivative"]):
            del kept[-1][-1]
    return kept


def test_the_errors_in_the_readme_are_those_of_the_program(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    command, *expected = blocks(read("README.md"))[3].strip().splitlines()
    assert command == "$ rbstab check wrong.yaml"
    wrong = """\
title: My body
body:
  mass: -41
  inertia: [10.0, 8.0, 0.4]
  contact_point: [0.15, 0.10]
controller:
  variant: free
  Kt: [4100, 4100, 3280]
  L_t: [200, 200, 140]
  K_r: [[400, 0, 0], [0, 400, 500], [0, 500, 320]]
  L_r: [60, 60, 42]
initial:
  orientation: [0, 90, 0]
integration:
  duration: 2.0
"""
    monkeypatch.chdir(tmp_path)
    Path("wrong.yaml").write_text(wrong)
    done = CliRunner().invoke(cli, ["check", "wrong.yaml"])
    assert done.stderr.splitlines() == expected


@pytest.mark.parametrize("name", COLUMNS)
def test_each_column_of_a_sweep_is_described(name: str) -> None:
    column = COLUMNS[name]
    dimensions = ", ".join(["run", *column.dimensions])
    rows = [row for row in read("results/README.md").splitlines() if f"`{name}`" in row]
    assert any(f"| {dimensions} | {column.unit} |" in row for row in rows)
