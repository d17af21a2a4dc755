"""Protects the way on after a slip or a finished command: what was meant, and the command that does
it, with paths that can be pasted into a shell.
"""

import sys
from pathlib import Path

import pytest
from cli.conftest import GOOD, Invoke
from support.printed_paths import words_of

from rbstab.files.shell_words import shell_word
from rbstab.store.errors import StoreError
from rbstab_cli.output.answers import named

SWEEP = shell_word(Path("my results", "plan"))

PLAN = "base: good.yaml\nvary: {body.mass: {values: [40, 41]}}\n"


@pytest.mark.usefixtures("folder")
def test_an_example_that_was_not_copied_is_named(rbstab: Invoke) -> None:
    """As where a reader of the README does not work in a copy of the repository."""
    for command, path in (
        ("run", "configs/paper/case1_permanent.yaml"),
        ("sweep", "configs/sweeps/variants.yaml"),
    ):
        refused = rbstab(command, path)
        assert refused.exit_code == 2
        name = path.removeprefix("configs/").removesuffix(".yaml")
        assert f"(expected a YAML file; `rbstab examples {name}` copies it)" in refused.stderr
        assert rbstab("examples", name).exit_code == 0
        assert Path(path).is_file()
    assert "`rbstab examples` lists others)" in rbstab("run", "configs/none.yaml").stderr


def test_the_next_command_after_a_run(folder: Path, rbstab: Invoke) -> None:
    done = rbstab("run", "good.yaml", "-o", "my results")
    (line,) = [line for line in done.stderr.splitlines() if line.startswith("Next: ")]
    words = words_of(line.removeprefix("Next: "))
    assert words[0] == "rbstab"
    assert rbstab(*words[1:]).exit_code == 0


@pytest.mark.usefixtures("plan", "use_fake_engine")
def test_the_next_command_after_a_sweep(rbstab: Invoke) -> None:
    done = rbstab("sweep", "plan.yaml", "-o", "my results")
    assert done.stderr.endswith(f"Next: rbstab report {SWEEP}\n")
    assert "Next" not in rbstab("sweep", "plan.yaml", "-o", "my results", "-q").stderr


@pytest.mark.usefixtures("plan", "use_fake_engine")
def test_the_next_command_after_a_part(rbstab: Invoke) -> None:
    done = rbstab("sweep", "plan.yaml", "-o", "my results", "--part", "1/1")
    assert done.stderr.endswith(
        "When all parts are done, run: rbstab sweep 'my results/plan/plan.yaml' -o 'my results'\n"
    )


@pytest.mark.usefixtures("plan")
@pytest.mark.skipif(sys.platform != "linux", reason="needs /proc, where no folder can be made")
@pytest.mark.parametrize(
    "arguments",
    [
        ("run", "good.yaml"),
        ("run", "good.yaml", "--prove"),
        ("sweep", "plan.yaml"),
        ("sweep", "plan.yaml", "--dry-run"),
    ],
    ids=" ".join,
)
def test_the_folder_is_tried_before_the_work(
    arguments: tuple[str, ...], rbstab: Invoke, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise AssertionError("the command began its work")

    for name in (
        "rbstab.experiment.run_to_file.simulate_problem",
        "rbstab.experiment.proof_cache.proof_for",
        "rbstab.sweep.sweep.sweep_to_folder",
        "rbstab.sweep.folder.open_folder.sweep_bytes",
    ):
        monkeypatch.setattr(name, fail)
    done = rbstab(*arguments, "-o", "/proc/results")
    assert done.exit_code == 4
    assert done.stderr.startswith("error: /proc/results cannot be written: ")
    assert done.stderr.endswith(". Nothing was run; -o names another folder.\n")


@pytest.mark.usefixtures("folder")
def test_stored_results_are_read_from_a_folder_that_cannot_be_written(
    rbstab: Invoke, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(folder: Path) -> None:
        raise StoreError(f"{folder} cannot be written: tried")

    assert rbstab("run", "good.yaml").exit_code == 0
    monkeypatch.setattr("rbstab.store.disk.paths.check_folder", fail)
    assert "already done" in rbstab("run", "good.yaml").stderr
    Path("other.yaml").write_text(GOOD)
    assert "cannot be written: tried" in rbstab("run", "good.yaml", "other.yaml").stderr


@pytest.mark.usefixtures("folder")
def test_after_several_runs_the_report_of_all_is_next(rbstab: Invoke) -> None:
    names = [f"a {number}" for number in range(7)]
    for name in names:
        Path(f"{name}.yaml").write_text(GOOD)
    run = ("run", "--no-prove", "-o", "my results")
    two = rbstab(*run, "a 0.yaml", "a 1.yaml")
    files = [Path("my results", f"{name}.h5") for name in names]
    assert two.stderr.endswith(f"Next: rbstab report {' '.join(map(shell_word, files[:2]))}\n")
    # All runs that share an answer are named, as far as there is room.
    assert f"{files[0]}, {files[1]}\n  Outcome: " in two.stdout
    many = rbstab(*run, *(f"{name}.yaml" for name in names))
    assert many.stderr.endswith(f"Next: rbstab report {shell_word('my results')}\n")
    words = words_of(many.stderr.splitlines()[-1].removeprefix("Next: rbstab"))
    assert "7 runs" in rbstab(*words, "--format", "text").stdout


def test_names_that_do_not_fit_are_counted() -> None:
    paths = [Path(f"results/{'x' * 60}{number}.h5") for number in range(4)]
    assert named(paths) == f"{paths[0]}, {paths[1]} and 2 more"
    assert named(paths[:1]) == str(paths[0])
