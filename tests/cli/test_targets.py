"""Files that a command may not read or replace are told before its work: pipes, devices, sockets,
folders, long names, folders that are missing, closed or read-only. No command waits for them.
"""

import os
import shlex
import socket
import stat
import sys
from pathlib import Path

import pytest
from cli.conftest import GOOD, PLAN_OF_MASSES, STORED, ended, rbstab, replace_everywhere, success
from support.closed_folders import close
from support.hang_guard import time_limit
from support.made_runs import made_file
from support.printed_paths import printed
from support.stored_proofs import store_proof_of

from rbstab.store.disk.paths import check_folder
from rbstab.store.errors import StoreError

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="other files and names there")

READERS = {
    **dict.fromkeys(
        (
            *("check", "run", "run --member 0", "sweep", "stability", "sensitivities", "guard"),
            "tune --objective energy --over controller.K_t",
        ),
        2,
    ),
    **dict.fromkeys(
        ("show", "report --format text", "export -o new.csv", "plot", "verify", "sweep --status"), 4
    ),
}
"""Commands that read a file, with the exit code if they cannot."""

WRITERS = {
    "stability good.yaml --search-only --no-run -o": ".txt",
    "sensitivities good.yaml -o": ".json",
    "tune good.yaml --objective energy --over controller.K_t -o": ".yaml",
    "guard held.yaml -o": ".yaml",
    "report made.h5 --format text -o": ".txt",
    "report made.h5 -o": ".md",
    "export made.h5 -o": ".csv",
    "plot made.h5 --figure runs-decay -o": ".svg",
    "verify proofs/*.json --certificate": ".json",
}
"""Commands that write a file, with the end of its name."""

TARGETS = {
    **dict.fromkeys(("pipe", "socket", "device", "folder", "read-only"), ""),
    "existing": "already exists",
    "missing": "the folder no does not exist",
    "dangling": "is a link to a missing file or folder",
    "long": "File name too long",
}
"""What stands where a file is to be written, with what is said of it."""


@pytest.fixture
def special(folder):
    """In the working folder: files of every kind, with every ending that commands need."""
    (folder / "held.yaml").write_text(GOOD.replace("variant: free", "variant: permanent"))
    (folder / "plan.yaml").write_text(PLAN_OF_MASSES)
    made_file(folder / "made.h5")
    store_proof_of(STORED / "runs/embedded.h5", folder)
    with socket.socket(socket.AF_UNIX) as bound:
        bound.bind("socket")
        for ending in {"", *WRITERS.values()}:
            os.mkfifo(f"pipe{ending}")
            Path(f"folder{ending}").mkdir()
            Path(f"device{ending}").symlink_to("/dev/zero")
            Path(f"dangling{ending}").symlink_to("nowhere/file")
            Path(f"existing{ending}").write_text("mine")
            if ending:
                os.link("socket", f"socket{ending}")
        yield


@pytest.mark.parametrize("kind", ["pipe", "socket", "device", "folder"])
@pytest.mark.parametrize("command", READERS)
def test_what_is_no_file_is_not_read(special, command, kind):
    name, *options = command.split()
    with time_limit(60):
        done = rbstab(name, *options, kind)
    code = READERS[command]
    # `show` lists the results in a folder, here none.
    assert done.exit_code == (0 if (kind, command) == ("folder", "show") else code), done.output
    assert kind in done.stderr.splitlines()[0]
    if code == 2:
        assert done.stderr.startswith(f"{kind}:1:1: cannot be read: ")
        assert len(done.stderr.splitlines()) == 1
        assert ("it is a " in done.stderr) == (kind != "folder")


def identity(path):
    """Return what tells whether a file was replaced or changed."""
    status = path.lstat()
    content = path.read_bytes() if stat.S_ISREG(status.st_mode) else b""
    return status.st_ino, stat.S_IFMT(status.st_mode), content


@pytest.mark.parametrize("force", ["", "--force"])
@pytest.mark.parametrize("kind", TARGETS)
@pytest.mark.parametrize("command", WRITERS)
@pytest.mark.usefixtures("special")
def test_a_file_that_cannot_be_written_is_told_before_the_work(
    command, kind, force, request, monkeypatch
):
    if (kind, force) == ("existing", "--force") or (kind, command[:6]) == ("missing", "report"):
        # A file is replaced on request, and a report makes its folder.
        return
    ending = WRITERS[command]
    target = {"missing": f"no/out{ending}", "long": f"{'x' * 256}{ending}"}.get(kind, kind + ending)
    if kind == "read-only":
        access = os.access
        # Also for the superuser.
        monkeypatch.setattr(
            os, "access", lambda name, mode: not mode & os.W_OK and access(name, mode)
        )
    elif kind not in ("long", "missing"):
        before = identity(Path(target))
    request.getfixturevalue("no_work")
    (proof,) = Path("proofs").iterdir()
    with time_limit(60):
        done = rbstab(*command.replace("proofs/*.json", str(proof)).split(), target, *force.split())
    assert done.exit_code in (2, 4), done.output
    assert TARGETS[kind] in done.stderr
    assert kind == "long" or target in done.stderr or "cannot be written" in done.stderr
    assert done.stdout == ""
    if kind in ("long", "missing", "read-only"):
        assert not os.path.lexists(target[:200])
    else:
        assert identity(Path(target)) == before


COMMANDS = (
    *("run good.yaml", "run good.yaml --prove", "sweep plan.yaml", "sweep plan.yaml --dry-run"),
    "run plan.yaml --member 0",
)


@pytest.mark.parametrize(
    "place", ["pipe", "socket", "device", "good.yaml/results", "/proc/results"]
)
@pytest.mark.parametrize("command", COMMANDS)
def test_a_folder_of_results_is_tried_before_the_work(special, no_runs, command, place):
    with time_limit(60):
        done = rbstab(*command.split(), "-o", place)
    assert done.exit_code == 4
    assert done.stderr.startswith(f"error: {place}")
    assert done.stderr.endswith(". Nothing was run; -o names another folder.\n")
    assert len(done.stderr.splitlines()) == 1


@pytest.mark.parametrize("command", ["run good.yaml", "sweep plan.yaml"])
def test_the_folder_of_proofs_is_tried_too(special, command, request):
    Path("results").mkdir()
    Path("results/proofs").write_text("in the way")
    request.getfixturevalue("no_runs")
    done = ended(4, *command.split(), "--engine", "scipy")
    assert done.stderr.startswith(printed("error: results/proofs cannot be written: "))
    assert done.stderr.endswith(
        ". Nothing was run; -o names another folder, --no-prove makes no proofs.\n"
    )
    assert list(Path("results").iterdir()) == [Path("results/proofs")]


def test_what_is_stored_needs_no_folder_that_can_be_written(folder, monkeypatch):
    """The folder of proofs, or that of results, may be that of another user."""
    success("run", "good.yaml", "-q")
    Path("again.yaml").write_text(GOOD)
    Path("other.yaml").write_text(GOOD.replace("mass: 41", "mass: 42"))
    closed: list[Path] = [Path("results/proofs")]

    def fail(folder: Path) -> None:
        if folder in closed:
            raise StoreError(f"{folder} cannot be written: tried")
        check_folder(folder)

    replace_everywhere(monkeypatch, "rbstab.store.disk.paths.check_folder", fail)
    success("run", "again.yaml", "--no-prove")
    refused = ended(4, "run", "other.yaml")
    assert "cannot be written: tried. Nothing was run" in refused.stderr
    closed.append(Path("results"))
    assert "already done" in rbstab("run", "good.yaml", "again.yaml").stderr
    ended(4, "run", "good.yaml", "other.yaml")


def test_with_force_a_closed_folder_is_told(no_runs, folder, monkeypatch):
    """Whether results exist is not known where their folder may not be entered."""
    made_file(folder / "results/good.h5")
    close(folder / "results", monkeypatch)
    done = ended(4, "run", "good.yaml", "--no-prove", "--force")
    assert done.stderr == (
        "error: results cannot be written: Permission denied. Nothing was run; -o names another "
        "folder.\n"
    )


@pytest.mark.parametrize("force", ["", "--force"])
def test_a_pipe_with_the_name_of_a_result_stays(force, folder):
    Path("results").mkdir()
    os.mkfifo("results/good.h5")
    with time_limit(60):
        done = rbstab("run", "--no-prove", "good.yaml", *force.split())
    assert done.exit_code == 4
    assert "results/good.h5" in done.stderr
    assert "pipe" in done.stderr
    assert stat.S_ISFIFO(Path("results/good.h5").lstat().st_mode)


@pytest.mark.parametrize("stem", ["x" * 251, "é" * 125], ids=["251", "UTF-8"])
def test_the_longest_names_are_written(stem, folder):
    Path(f"{stem}.yml").write_text(GOOD)
    for force in ((), ("--force",)):
        success("run", "--no-prove", f"{stem}.yml", *force)
        assert [path.name for path in Path("results").iterdir()] == [f"{stem}.h5"]
    report = "r" * 250 + ".html"
    success("report", f"results/{stem}.h5", "-o", report)
    assert Path(report).is_file()


@pytest.mark.parametrize(
    "command",
    [
        "run LONG.yaml --set body.mass=50 --force",
        "run plan-LONG.yaml --member 0",
        "tune LONG.yaml --objective energy --over controller.K_t",
    ],
)
def test_a_name_that_the_program_makes_may_be_too_long(no_work, command, folder):
    """Of a result that is moved aside, of that of a member, and of a tuned config."""
    long = "x" * 245
    made = made_file(folder / f"results/{long}.h5").read_bytes()
    Path(f"{long}.yaml").write_text(GOOD)
    Path(f"plan-{long}.yaml").write_text(PLAN_OF_MASSES)
    done = ended(4, *shlex.split(command.replace("LONG", long)))
    assert "File name too long" in done.stderr
    assert Path(f"results/{long}.h5").read_bytes() == made
