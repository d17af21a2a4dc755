"""Protects the check of output files before the work: long names, missing and read-only folders."""

import os
import sys
from pathlib import Path

import pytest
from cli.conftest import GOOD, Invoke
from support.printed_paths import printed

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="other limits of names there")


@pytest.fixture
def no_work(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let every computation fail the test."""

    def fail(*_: object, **__: object) -> None:
        raise AssertionError("the command began its work")

    for name in (
        "rbstab.experiment.run_to_file.simulate_problem",
        "rbstab.experiment.tuning.tune.tune",
        "rbstab.experiment.tuning.sensitivities.sensitivities",
        "rbstab.experiment.stability.stability_of",
        "rbstab.report.build.report_of",
    ):
        monkeypatch.setattr(name, fail)


@pytest.mark.parametrize("stem", ["x" * 240, "x" * 251, "é" * 125], ids=["240", "251", "UTF-8"])
def test_the_longest_names_are_written(stem: str, folder: Path, rbstab: Invoke) -> None:
    Path(f"{stem}.yml").write_text(GOOD)
    for more in ((), ("--force",)):
        done = rbstab("run", "--no-prove", f"{stem}.yml", *more)
        assert done.exit_code == 0, done.stderr
        assert [path.name for path in Path("results").iterdir()] == [f"{stem}.h5"]
    assert rbstab("show", f"results/{stem}.h5").exit_code == 0
    report = "r" * 250 + ".html"
    assert rbstab("report", f"results/{stem}.h5", "-o", report).exit_code == 0
    assert Path(report).is_file()


@pytest.mark.usefixtures("no_work")
@pytest.mark.parametrize(
    "arguments",
    [
        ("stability", "good.yaml", "--search-only", "-o", "x" * 256),
        ("sensitivities", "good.yaml", "-o", "x" * 256),
        ("tune", "good.yaml", "--objective", "energy", "--over", "controller.K_t"),
        ("report", "good.h5", "--format", "text", "-o", "x" * 256),
        ("report", "good.h5", "-o", "x" * 250 + ".md"),
    ],
    ids=lambda arguments: arguments[0],
)
def test_a_name_that_is_too_long(arguments: tuple[str, ...], folder: Path, rbstab: Invoke) -> None:
    if arguments[0] == "tune":
        # CONFIG.yaml gives CONFIG_tuned.yaml.
        Path("x" * 248 + ".yaml").write_text(GOOD)
        arguments = ("tune", "x" * 248 + ".yaml", *arguments[2:])
    done = rbstab(*arguments)
    assert done.exit_code == 4
    assert "File name too long" in done.stderr
    assert len(done.stderr.splitlines()) == 1


@pytest.mark.usefixtures("no_work")
def test_a_member_whose_result_would_have_too_long_a_name(folder: Path, rbstab: Invoke) -> None:
    plan = Path("x" * 248 + ".yaml")
    plan.write_text("base: good.yaml\nvary: {body.mass: {values: [40]}}\n")
    done = rbstab("run", "--no-prove", str(plan), "--member", "0")
    assert done.exit_code == 4
    assert "File name too long" in done.stderr


def test_the_name_of_a_result_that_is_moved_aside(
    folder: Path, rbstab: Invoke, request: pytest.FixtureRequest
) -> None:
    config = Path("x" * 248 + ".yaml")
    config.write_text(GOOD)
    assert rbstab("run", "--no-prove", str(config), "-q").exit_code == 0
    result = Path("results", f"{config.stem}.h5")
    before = result.read_bytes()
    request.getfixturevalue("no_work")
    done = rbstab("run", "--no-prove", str(config), "--set", "body.mass=50", "--force")
    assert done.exit_code == 4
    assert "File name too long" in done.stderr
    assert result.read_bytes() == before


@pytest.fixture
def read_only(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Make the working folder read-only, also for the superuser."""
    access = os.access
    monkeypatch.setattr(os, "access", lambda path, mode: mode & os.W_OK == 0 and access(path, mode))


@pytest.mark.usefixtures("read_only", "no_work")
@pytest.mark.parametrize(
    "arguments",
    [
        ("run", "--no-prove", "good.yaml"),
        ("stability", "good.yaml", "--search-only", "-o", "new.txt"),
        ("sensitivities", "good.yaml", "-o", "new.json"),
        ("tune", "good.yaml", "--objective", "energy", "--over", "controller.K_t"),
        ("report", "good.h5", "-o", "new.html"),
    ],
    ids=lambda arguments: arguments[0],
)
def test_a_folder_that_cannot_be_written(arguments: tuple[str, ...], rbstab: Invoke) -> None:
    done = rbstab(*arguments)
    assert done.exit_code == 4
    assert "cannot be written: . is not writable" in done.stderr


@pytest.mark.usefixtures("no_work")
@pytest.mark.parametrize("command", ["stability", "sensitivities", "tune"])
def test_a_folder_that_does_not_exist(command: str, folder: Path, rbstab: Invoke) -> None:
    more = ("--objective", "energy", "--over", "controller.K_t") if command == "tune" else ()
    done = rbstab(command, "good.yaml", *more, "-o", "no/out")
    assert done.exit_code == 4
    assert done.stderr == printed("no/out: cannot be written: the folder no does not exist\n")


@pytest.mark.usefixtures("no_work")
def test_a_link_to_a_missing_file(folder: Path, rbstab: Invoke) -> None:
    Path("link.json").symlink_to("nowhere/file")
    done = rbstab("sensitivities", "good.yaml", "-o", "link.json", "--force")
    assert done.exit_code == 4
    assert "link.json is a link to a missing file or folder" in done.stderr


def test_a_finished_run_needs_no_writable_folder(
    folder: Path, rbstab: Invoke, request: pytest.FixtureRequest
) -> None:
    assert rbstab("run", "--no-prove", "good.yaml", "-q").exit_code == 0
    request.getfixturevalue("read_only")
    request.getfixturevalue("no_work")
    done = rbstab("run", "--no-prove", "good.yaml")
    assert done.exit_code == 0
    assert "already done" in done.stderr
