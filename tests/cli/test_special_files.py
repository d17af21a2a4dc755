"""Protects every command against pipes, devices, sockets and folders in place of files: no command
waits for them, reads them without end, or replaces them.
"""

import os
import socket
import stat
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from cli.conftest import Invoke
from support.hang_guard import time_limit
from support.printed_paths import printed

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="no such files there")

KINDS = ("pipe", "socket", "device", "folder")

CONFIG_COMMANDS = {
    "check": (),
    "run": (),
    "run --member": ("--member", "0"),
    "sweep": (),
    "stability": (),
    "sensitivities": (),
    "tune": ("--objective", "energy", "--over", "controller.K_t"),
}


@pytest.fixture
def special(folder: Path) -> Iterator[dict[str, Path]]:
    """A named pipe without a writer, a socket, a device that never ends, and a folder."""
    os.mkfifo("pipe.yaml")
    Path("folder.yaml").mkdir()
    with socket.socket(socket.AF_UNIX) as bound:
        bound.bind("socket.yaml")
        yield {
            "pipe": Path("pipe.yaml"),
            "socket": Path("socket.yaml"),
            "device": Path("/dev/zero"),
            "folder": Path("folder.yaml"),
        }


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("command", CONFIG_COMMANDS)
def test_configs_and_plans(
    kind: str, command: str, special: dict[str, Path], rbstab: Invoke
) -> None:
    with time_limit(60):
        done = rbstab(
            command.removesuffix(" --member"), str(special[kind]), *CONFIG_COMMANDS[command]
        )
    assert done.exit_code == 2
    [line] = done.stderr.splitlines()
    assert line.startswith(f"{special[kind]}:1:1: cannot be read: ")
    assert ("it is a " in line) == (kind != "folder")


@pytest.mark.parametrize("kind", ["pipe", "socket", "device"])
def test_the_base_of_a_plan(kind: str, special: dict[str, Path], rbstab: Invoke) -> None:
    Path("plan.yaml").write_text(f"base: {special[kind]}\nvary: {{body.mass: {{values: [40]}}}}\n")
    with time_limit(60):
        done = rbstab("sweep", "--no-prove", "plan.yaml")
    assert done.exit_code == 2
    assert "which is not a file" in done.stderr


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("arguments", [("show",), ("report", "--format", "text")], ids=" ".join)
def test_results(
    kind: str, arguments: tuple[str, ...], special: dict[str, Path], rbstab: Invoke
) -> None:
    with time_limit(60):
        done = rbstab(*arguments, str(special[kind]))
    # `show` lists the results in a folder, here none.
    assert done.exit_code == (0 if (kind, *arguments) == ("folder", "show") else 4)
    assert f"{special[kind]}" in done.stderr.splitlines()[0]
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize("kind", ["pipe", "socket", "device"])
@pytest.mark.parametrize(
    "arguments",
    [
        ("sweep", "--status"),
        ("run", "--no-prove", "good.yaml", "-o"),
        ("sweep", "--no-prove", "plan.yaml", "-o"),
    ],
    ids=" ".join,
)
def test_folders(
    kind: str, arguments: tuple[str, ...], special: dict[str, Path], rbstab: Invoke
) -> None:
    Path("plan.yaml").write_text("base: good.yaml\nvary: {body.mass: {values: [40]}}\n")
    with time_limit(60):
        done = rbstab(*arguments, str(special[kind]))
    assert done.exit_code == 4
    assert len(done.stderr.splitlines()) == 1


@pytest.mark.parametrize("force", [(), ("--force",)], ids=["", "--force"])
@pytest.mark.parametrize("kind", ["pipe", "socket", "link to a device", "folder"])
@pytest.mark.parametrize(
    "arguments",
    [
        ("report", "results/good.h5", "--format", "text"),
        ("report", "results/good.h5", "--format", "md"),
        ("sensitivities", "good.yaml"),
        ("stability", "good.yaml", "--search-only", "--no-run"),
        ("tune", "good.yaml", "--objective", "energy", "--over", "controller.K_t"),
    ],
    ids=" ".join,
)
def test_outputs_are_never_replaced(  # noqa: PLR0917 (cases and fixtures)
    arguments: tuple[str, ...],
    kind: str,
    force: tuple[str, ...],
    special: dict[str, Path],
    rbstab: Invoke,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    Path("link.yaml").symlink_to("/dev/null")
    target = special.get(kind, Path("link.yaml"))
    if arguments[0] == "report":
        assert rbstab("run", "--no-prove", "good.yaml", "-q").exit_code == 0
    else:
        # The error comes before the work.
        monkeypatch.setattr(f"rbstab_cli.commands.{arguments[0]}.load_all", _not_called)
    before = target.lstat()
    with time_limit(60):
        done = rbstab(*arguments, "-o", str(target), *force)
    assert done.exit_code in (2, 4)
    assert str(target) in done.stderr
    assert "Traceback" not in done.stderr
    after = target.lstat()
    assert after.st_ino == before.st_ino
    assert stat.S_IFMT(after.st_mode) == stat.S_IFMT(before.st_mode)


def _not_called(*_: object) -> None:
    raise AssertionError("the command began its work")


@pytest.mark.parametrize("force", [(), ("--force",)], ids=["", "--force"])
def test_a_pipe_with_the_name_of_a_result(
    force: tuple[str, ...], folder: Path, rbstab: Invoke
) -> None:
    Path("results").mkdir()
    os.mkfifo("results/good.h5")
    with time_limit(60):
        done = rbstab("run", "--no-prove", "good.yaml", *force)
    assert done.exit_code == 4
    assert printed("results/good.h5") in done.stderr
    assert "pipe" in done.stderr
    assert stat.S_ISFIFO(Path("results/good.h5").lstat().st_mode)


FILES_OF_A_SWEEP = ["shards/00000000.h5", "members.h5", "manifest.json", "plan.yaml"]


@pytest.mark.parametrize("name", FILES_OF_A_SWEEP)
def test_pipes_in_the_folder_of_a_sweep(name: str, folder: Path, rbstab: Invoke) -> None:
    Path("plan.yaml").write_text("base: good.yaml\nvary: {body.mass: {values: [40, 41]}}\n")
    sweep = ("sweep", "--no-prove", "plan.yaml", "--engine", "scipy", "-q")
    assert rbstab(*sweep).exit_code == 0
    Path("results/plan", name).unlink()
    os.mkfifo(Path("results/plan", name))
    commands = [
        ("export", "results/plan", "-o", "sweep.nc"),
        ("sweep", "--status", "results/plan"),
        ("report", "results/plan", "--format", "text"),
        sweep,
    ]
    for command in commands:
        with time_limit(60):
            done = rbstab(*command)
        # A pipe that the command does not need is no error.
        assert done.exit_code in (0, 4), (command, done.exception)
        assert done.exit_code == 0 or "Traceback" not in done.stderr
    # A plan that cannot be read is written again.
    assert (done.exit_code == 0) == (name == "plan.yaml")
