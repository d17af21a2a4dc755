"""Protects `docs/elements.md`: its example is the file, its keys, units and drawings are those of
the program, and its commands run.
"""

import re
import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from click.testing import CliRunner

import rbstab
from rbstab.config.elements import RESERVED_NAMES
from rbstab.elements.registry import KINDS
from rbstab_cli.main import cli

ROOT = Path(__file__).parents[2]
FIGURES = ROOT / "docs" / "figures"
PAGE = (FIGURES.parent / "elements.md").read_text(encoding="utf-8")
SECTIONS = {"spring": "Spring", "visco-elastic": "Visco-elastic tie", "attitude": "Attitude"}
COMMANDS = [
    command.split()
    for block in re.findall(r"```console\n(.*?)```", PAGE, flags=re.DOTALL)
    for command in re.findall(r"^\$ rbstab (.*)$", block, flags=re.MULTILINE)
]
SLOW = ("sensitivities", "tune", "sweep")


def section(heading: str) -> str:
    """Return the text below a heading of the page."""
    return PAGE.split(f"\n## {heading}\n")[1].split("\n## ")[0]


@pytest.fixture(scope="module")
def drawings() -> ModuleType:
    """The program that makes the drawings."""
    spec = spec_from_file_location("elements_figures", FIGURES / "elements.py")
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder with the configs of the repository, and one of version 1."""
    (tmp_path / "configs").symlink_to(ROOT / "configs")
    text = (ROOT / "configs/paper/case1_permanent.yaml").read_text(encoding="utf-8")
    (tmp_path / "my_config.yaml").write_text(text, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_example_is_the_file() -> None:
    (block,) = re.findall(r"```yaml\n(.*?)```", PAGE, flags=re.DOTALL)
    path = ROOT / "configs/examples/elements.yaml"
    assert block == path.read_text(encoding="utf-8")
    kinds = {element.kind for element in rbstab.load_config(path).elements.values()}
    joint = rbstab.load_config(ROOT / "configs/examples/joint.yaml")
    assert kinds | {element.kind for element in joint.elements.values()} == set(KINDS)


def test_the_plan_and_the_second_example_say_what_the_page_says() -> None:
    proved = rbstab.load_config(ROOT / "configs/examples/elements_proved.yaml")
    assert {element.kind for element in proved.elements.values()} == {"visco-elastic", "attitude"}
    assert proved.controller.variant == "free"


@pytest.mark.parametrize(
    ("kind", "method"), [(k, m) for k, methods in KINDS.items() for m in methods]
)
def test_each_gain_has_its_row_with_its_unit(kind: str, method: str | None) -> None:
    text = section(SECTIONS.get(kind, kind.title()))
    if method is not None:
        text = text.split(f"\n### Method {method}\n")[1].split("\n### ")[0]
    rows = [line.split("|")[1:-1] for line in text.splitlines() if line.startswith("| `")]
    units = {key.strip("` "): row[2].strip() for row in rows for key in row[0].split(",")}
    expected = {gain.name: gain.unit for gain in KINDS[kind][method].gains}
    assert units == expected | ({} if method is None else {"method": "-"})
    assert f"| [`{kind}`](#" in PAGE


def test_each_reserved_name_is_listed() -> None:
    for name in RESERVED_NAMES:
        assert f"`{name}`" in section("The schema")


def test_the_drawings_are_those_of_the_program(drawings: ModuleType) -> None:
    made = drawings.drawings()
    used = re.findall(r"!\[([^\]]+)\]\(figures/(elements_\w+\.svg)\)", PAGE)
    assert {name for _, name in used} == set(made)
    assert {path.name for path in FIGURES.glob("*.svg")} == set(made)
    assert all(len(words) > 60 for words, _ in used)
    for name, text in made.items():
        stored = (FIGURES / name).read_text(encoding="utf-8")
        assert without_numbers(stored) == without_numbers(text), "run `make figures`"
        assert numbers(stored) == pytest.approx(numbers(text), abs=0.2)


def without_numbers(text: str) -> str:
    return re.sub(r"-?\d+\.\d+", "#", text)


def numbers(text: str) -> list[float]:
    return [float(number) for number in re.findall(r"-?\d+\.\d+", text)]


def test_each_drawing_is_an_image_with_colours_for_both_modes(drawings: ModuleType) -> None:
    for text in drawings.drawings().values():
        root = ElementTree.fromstring(text)  # noqa: S314 it is our own text
        style = next(node.text for node in root.iter() if node.tag.endswith("style"))
        light, dark = (style or "").split("@media (prefers-color-scheme: dark)")
        used = {word for node in root.iter() for word in node.get("class", "").split()}
        for name in used - {"symbol", "part-text", "force-text", "blue-text", "small"}:
            assert f".{name}" in light
            assert f".{name}" in dark
        card = next(node for node in root.iter() if node.get("class") == "card")
        assert float(card.get("width", 0)) > 0.99 * float(root.get("width", 0))


def test_the_curves_are_the_energies_of_the_page(drawings: ModuleType) -> None:
    """The energies of the drawings have the closed forms that the page prints."""
    from rbstab.elements.attitude_spring import AttitudeSpring
    from rbstab.elements.barrier import Barrier

    angles = np.linspace(-1.2, 1.2, 7)
    turned = AttitudeSpring(name="", K=20 * np.eye(3), L=np.eye(3))
    for axis in range(3):
        found = drawings.energies(turned, angles, axis)
        assert found == pytest.approx(20 * (1 - np.cos(angles)), abs=1e-12)
    guard = Barrier(name="", stiffness=3.0, outer_stiffness=2.0)
    assert drawings.energies(guard, angles, 1) == pytest.approx(1.5 * np.tan(angles) ** 2)
    assert drawings.energies(guard, angles, 0) == pytest.approx(np.tan(angles / 2) ** 2)


def test_small_rotations_have_the_stiffness_that_the_page_says(drawings: ModuleType) -> None:
    from rbstab.elements.attitude_spring import AttitudeSpring

    element = AttitudeSpring(name="", K=np.diag([60.0, 60.0, 40.0]), L=np.eye(3))
    small = np.array([1e-3])
    for axis, stiffness in enumerate((50.0, 50.0, 60.0)):
        found = drawings.energies(element, small, axis)
        assert found == pytest.approx(0.5 * stiffness * small**2, rel=1e-5)
    assert "50 N m/rad about the first two" in PAGE
    assert "60 about the third" in PAGE


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize(
    "command",
    [
        pytest.param(command, marks=[pytest.mark.slow] if command[0] in SLOW else [])
        for command in COMMANDS
    ],
    ids=" ".join,
)
def test_each_command_runs(command: list[str]) -> None:
    if command[0] in ("show", "report"):
        name = Path(command[1]).stem
        CliRunner().invoke(cli, ["run", f"configs/examples/{name}.yaml"])
    done = CliRunner().invoke(cli, command)
    assert done.exit_code == 0, done.output


def test_all_commands_are_tried() -> None:
    tried = [command[0] for command in COMMANDS]
    first = ["run", "show", "run", "report"]
    stop = ["run", "show", "report"]
    expected = [*first, "upgrade", *stop, "run", "sensitivities", "tune", "sweep"]
    assert tried == [*expected, "stability", "stability"]


@pytest.mark.usefixtures("folder")
def test_what_the_page_prints() -> None:
    assert CliRunner().invoke(cli, ["upgrade", "my_config.yaml"]).stdout in PAGE
    (expected,) = re.findall(r"```text\n(.*?)```", PAGE, flags=re.DOTALL)
    printed = CliRunner().invoke(cli, [*COMMANDS[-2], "--no-run"]).stdout
    assert expected in printed
    settled = rbstab.simulate("configs/examples/elements.yaml")
    v, t = settled["lyapunov"], settled["time"]
    assert t[v > v[0] / 1000].max() == pytest.approx(0.8, abs=0.05)


@pytest.mark.usefixtures("folder")
def test_the_python_of_the_page_runs() -> None:
    (code,) = re.findall(r"```python\n(.*?)```", PAGE, flags=re.DOTALL)
    names: dict[str, Any] = {}
    exec(code, names)  # noqa: S102 it is our own page
    assert names["data"]["element_force"].sel(element="foot").dims == ("time", "axis")


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize("kind", KINDS)
def test_which_kinds_are_proved(kind: str) -> None:
    config = "configs/examples/elements_proved.yaml"
    examples = [rbstab.load_config(f"configs/examples/{n}.yaml") for n in ("elements", "joint")]
    elements = [element for example in examples for element in example.elements.values()]
    one = next(e for e in elements if e.kind == kind).model_dump(mode="json")
    data = rbstab.load_config(config).model_dump(mode="json", exclude_none=True)
    proof = rbstab.prove(rbstab.load_config(data | {"elements": {"one": one}}))
    assert bool(proof.unique) == (kind in ("visco-elastic", "attitude", "guard"))
    assert proof.every_start == (kind == "guard")
    without = {key: value for key, value in data.items() if key != "controller"}
    assert not rbstab.prove(rbstab.load_config(without)).unique
