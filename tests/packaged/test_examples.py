"""Protects the examples that come with the program: all are found, named, and copied as a whole."""

from pathlib import Path

import pytest

import rbstab
from rbstab.packaged import examples
from rbstab.packaged.examples import (
    UnknownExampleError,
    described,
    examples_folder,
    examples_named,
    files_of,
    names,
)

ROOT = Path(__file__).parents[2]

FILES = {path.relative_to(ROOT / "configs") for path in (ROOT / "configs").rglob("*.yaml")}


def test_all_configs_and_plans_are_examples():
    assert {Path(f"{name}.yaml") for name in names()} == FILES
    assert examples_folder() == ROOT / "configs"


def test_those_of_the_paper_come_first():
    assert [name.partition("/")[0] for name in names()] == sorted(
        (name.partition("/")[0] for name in names()), key=["paper", "examples", "sweeps"].index
    )


@pytest.mark.parametrize("name", names())
def test_each_example_loads_as_what_it_is_called(name):
    example = described(name)
    assert example.is_plan == name.startswith("sweeps/")
    if not example.is_plan:
        # The elements of users among them are ours.
        assert rbstab.load_config(example.path, allow_python=True).title == example.title


def test_names():
    assert examples_named("paper/case1_permanent") == ["paper/case1_permanent"]
    assert examples_named("case1_permanent.yaml") == ["paper/case1_permanent"]
    assert examples_named("examples/sliding/") == [n for n in names() if "sliding/" in n]
    assert set(examples_named("paper")) == {n for n in names() if n.startswith("paper/")}
    assert rbstab.example("joint") == ROOT / "configs/examples/joint.yaml"


def test_a_name_of_several():
    with pytest.raises(UnknownExampleError, match=r"paper names \d+ examples: paper/case1_guarded"):
        rbstab.example("paper")


def test_a_plan_comes_with_its_base():
    files = files_of(["sweeps/strut_stiffness"])
    assert list(files) == [Path("examples/elements.yaml"), Path("sweeps/strut_stiffness.yaml")]
    assert all(path == ROOT / "configs" / below for below, path in files.items())


def test_a_config_comes_with_the_motion_that_was_measured():
    paths = [path.as_posix() for path in files_of(["examples/fitted"])]
    assert paths == ["examples/fitted.csv", "examples/fitted.yaml"]


def test_files_that_are_named_by_named_files_come_too_and_no_others(tmp_path, monkeypatch):
    folder = tmp_path / "configs"
    (folder / "sweeps").mkdir(parents=True)
    (folder / "data").mkdir()
    (tmp_path / "secret.csv").write_text("1")
    (folder / "data/push.csv").write_text("0, 0")
    (folder / "data/other.csv").write_text("0, 0")
    # A file that names itself, as a text may by chance, ends no search.
    (folder / "config.yaml").write_text(
        "title: config.yaml\nelements: {push: {file: data/push.csv}}\n"
    )
    (folder / "sweeps/plan.yaml").write_text(
        "base: ../config.yaml\nvary: {a: [../../secret.csv, /etc/hosts, '', ..]}\n"
    )
    monkeypatch.setattr(examples, "examples_folder", lambda: folder)
    files = files_of(["sweeps/plan"])
    paths = [path.as_posix() for path in files]
    assert paths == ["config.yaml", "data/push.csv", "sweeps/plan.yaml"]
