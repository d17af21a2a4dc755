"""Protects `rbstab init` and `rbstab examples`: what they write works; nothing is overwritten."""

from pathlib import Path

import pytest
from cli.conftest import ended, rbstab, success
from support.printed_paths import printed, words_of

from rbstab.config.load import load_config
from rbstab.files.text import chained_commands, shell_word

FILES = ["README.md", "experiment.yaml", "sweep.yaml"]


@pytest.fixture(autouse=True)
def working_folder(tmp_path, monkeypatch):
    """An empty working folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def contents(folder):
    return {p.as_posix(): p.read_text() for p in sorted(Path(folder).rglob("*")) if p.is_file()}


def test_init_here():
    done = success("init")
    assert done.stdout == ""
    assert sorted(contents(".")) == FILES
    assert done.stderr.endswith("Next: rbstab run experiment.yaml\n")
    assert load_config("experiment.yaml").controller.variant == "visco-elastic"
    success("check", "experiment.yaml")


@pytest.mark.parametrize("variant", ["free", "permanent", "embedded", "sliding"])
def test_init_of_a_variant_elsewhere(variant):
    done = success("init", "my first/one", "--variant", variant)
    second = "rbstab run experiment.yaml\n"
    both = chained_commands(f"cd {shell_word(Path('my first/one'))}", second)
    assert done.stderr.endswith(f"Next: {both}")
    assert load_config(Path("my first/one/experiment.yaml")).controller.variant == variant


def test_the_list_of_examples():
    done = success("examples")
    lines = done.stdout.splitlines()
    assert lines[0].split() == ["name", "kind", "title"]
    assert " ".join(lines[2].split()) == (
        "paper/case1_permanent config Case 1, permanently constrained body"
    )
    assert any(line.split()[:2] == ["sweeps/variants", "plan"] for line in lines[1:-1])
    assert contents(".") == {}


def test_a_copied_example_runs():
    done = success("examples", "case1_permanent")
    assert list(contents(".")) == ["configs/paper/case1_permanent.yaml"]
    line = done.stderr.splitlines()[-1].removeprefix("Next: rbstab ")
    success(*words_of(line))
    assert Path("results/case1_permanent.h5").is_file()


@pytest.mark.parametrize("command", ["run", "sweep"])
def test_a_copied_example_with_code_names_the_option_that_runs_it(command):
    name = {"run": "examples/cubic_spring", "sweep": "sweeps/cubic_spring"}[command]
    done = rbstab("examples", name)
    words = words_of(done.stderr.splitlines()[-1].removeprefix("Next: rbstab "))
    assert words == [command, printed(f"configs/{name}.yaml"), "--allow-python"]
    success("check", *words[1:])


@pytest.mark.parametrize("name", FILES)
def test_init_overwrites_nothing(name):
    Path(name).write_text("mine")
    done = ended(4, "init", "--variant", "sliding")
    assert done.stderr.splitlines() == [
        f"{name}: already exists; it is not overwritten",
        "Nothing was written. Choose another folder: rbstab init FOLDER --variant sliding",
    ]
    assert contents(".") == {name: "mine"}


def test_a_copy_of_an_example_overwrites_nothing():
    rbstab("examples", "elements")
    done = success("examples", "strut_stiffness")
    assert printed("configs/examples/elements.yaml is there already\n") in done.stderr
    # The copied plan finds its base.
    words = words_of(done.stderr.splitlines()[-1].removeprefix("Next: rbstab "))
    assert words == ["sweep", printed("configs/sweeps/strut_stiffness.yaml")]
    success(*words, "--dry-run", "--engine", "scipy")
    changed = Path("configs/examples/elements.yaml")
    changed.write_text(changed.read_text() + "# mine\n")
    before = contents("configs")
    done = ended(4, "examples", "strut_stiffness", "joint")
    assert done.stderr.splitlines() == [
        f"{changed}: already exists; it is not overwritten",
        "Nothing was written. Choose another folder: rbstab examples strut_stiffness joint "
        "-o FOLDER",
    ]
    assert contents("configs") == before
