"""Protects the output of every command: streams without all characters, closed, full, or a pipe
whose reader has ended.
"""

import io
import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import pytest
from cli.conftest import GOOD, success

from rbstab_cli import main

TITLE = "Θ, é, 😀"

UNICODE = GOOD.replace("A short run", f'"{TITLE}"')


class Ended(NamedTuple):
    """The exit code and the raw output of a command."""

    code: object
    stdout: bytes
    stderr: bytes


Run = Callable[..., Ended]


@pytest.fixture
def handlers():
    """Put the handler of SIGTERM back, which the entry point replaces."""
    before = signal.getsignal(signal.SIGTERM)
    yield
    signal.signal(signal.SIGTERM, before)


@pytest.fixture
def run_with(monkeypatch, handlers):
    """A function that calls the entry point with streams of an encoding that refuse the rest."""

    def run(encoding: str, *arguments: str) -> Ended:
        out, err = io.BytesIO(), io.BytesIO()
        streams = [io.TextIOWrapper(raw, encoding, errors="strict") for raw in (out, err)]
        with monkeypatch.context() as patched:
            patched.setattr(sys, "argv", ["rbstab", *arguments])
            patched.setattr(sys, "stdout", streams[0])
            patched.setattr(sys, "stderr", streams[1])
            with pytest.raises(SystemExit) as ended:
                main.main()
        for stream in streams:
            stream.flush()
        return Ended(ended.value.code, out.getvalue(), err.getvalue())

    return run


@pytest.fixture
def unicode_run(folder):
    """A working folder with a config and a result whose title is not ASCII."""
    (folder / "unicode.yaml").write_text(UNICODE, encoding="utf-8")
    success("run", "--no-prove", "unicode.yaml", "-q")
    return folder


COMMANDS = [
    ("--help",),
    ("sensitivities", "--help"),
    ("tune", "--help"),
    ("check", "unicode.yaml"),
    ("show", "results/unicode.h5"),
    ("show", "results/unicode.h5", "--json"),
    ("show", "results/unicode.h5", "--config"),
    ("report", "results/unicode.h5", "--format", "text"),
    ("report", "results/unicode.h5", "--json"),
    ("run", "--no-prove", "unicode.yaml", "--force"),
    ("stability", "unicode.yaml", "--search-only", "--no-run"),
    ("schema",),
]


@pytest.mark.parametrize("encoding", ["ascii", "latin-1"])
@pytest.mark.parametrize("arguments", COMMANDS, ids=" ".join)
def test_every_command_prints_in_every_encoding(encoding, arguments, unicode_run, run_with):
    ended = run_with(encoding, *arguments)
    assert ended.code == 0, ended.stderr
    assert ended.stdout


@pytest.mark.parametrize("encoding", ["ascii", "latin-1", "utf-8"])
def test_json_and_yaml_keep_every_character(encoding, unicode_run, run_with):
    shown = run_with(encoding, "show", "results/unicode.h5", "--json")
    assert json.loads(shown.stdout)["title"] == TITLE
    stored = run_with(encoding, "show", "results/unicode.h5", "--config")
    Path("again.yaml").write_bytes(stored.stdout)
    first, again = (run_with("utf-8", "check", name) for name in ("unicode.yaml", "again.yaml"))
    assert again.code == 0
    assert again.stdout.split(b"run id")[1] == first.stdout.split(b"run id")[1]
    shown = run_with("utf-8", "run", "--no-prove", "again.yaml", "--json")
    assert json.loads(shown.stdout)[0]["title"] == TITLE


def program(*arguments):
    return [sys.executable, "-m", "rbstab_cli", *arguments]


@pytest.mark.skipif(sys.platform == "win32", reason="file names are text there")
def test_names_that_are_not_utf_8(folder, run_with):
    name = os.fsdecode(b"\xff.yaml")
    (folder / name).write_text(GOOD)
    assert run_with("utf-8", "check", name).code == 0
    assert run_with("utf-8", "run", "--no-prove", name).code == 0
    options = ("--search-only", "--no-run", "-o", "out.txt")
    assert run_with("utf-8", "stability", name, *options).code == 0
    assert "\\udcff.yaml" in Path("out.txt").read_text(encoding="utf-8")


NAME = "größe"

IN_ASCII = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
"""The C locale without Python's UTF-8 mode: names are decoded as ASCII, with lone surrogates."""


@pytest.mark.skipif(sys.platform == "win32", reason="file names are text there")
@pytest.mark.parametrize("locale", [{"LC_ALL": "C"}, IN_ASCII], ids=["C", "ascii"])
def test_names_that_are_not_ascii_are_printed_in_the_c_locale(locale, tmp_path):
    unset = {"PYTHONIOENCODING", "PYTHONUTF8", "LC_CTYPE", "LANG"}
    environment = {name: text for name, text in os.environ.items() if name not in unset} | locale

    def printed(*arguments: str, code: int = 0) -> str:
        done = subprocess.run(
            program(*arguments), capture_output=True, env=environment, check=False, cwd=tmp_path
        )
        assert done.returncode == code, done.stderr
        # Every byte that is printed is UTF-8.
        return (done.stdout + done.stderr).decode()

    config, result = f"{NAME}/experiment.yaml", f"{NAME}/out/experiment.h5"
    quoted = f"'{NAME}'"
    assert f"-> {config}\n" in (made := printed("init", NAME))
    assert f"Next: cd {quoted} && rbstab run experiment.yaml\n" in made
    assert result in printed("run", config, "--no-prove", "-o", f"{NAME}/out")
    assert f"-> {NAME}/r.html\n" in printed("report", result, "-o", f"{NAME}/r.html")
    assert f"{NAME}/no.h5" in printed("show", f"{NAME}/no.h5", code=4)
    assert f"No such command {quoted}" in printed(NAME, code=2)
    page = (tmp_path / NAME / "r.html").read_text("utf-8")
    assert f"rbstab report &#39;{result}&#39; -o" in page
    assert "udcc" not in page


@pytest.mark.skipif(sys.platform == "win32", reason="no such exit code there")
@pytest.mark.parametrize(
    "arguments",
    [("schema",), ("--help",), ("run", "--help"), ("--version",), ("report", "--format", "text")],
    ids=" ".join,
)
def test_a_reader_that_has_ended_ends_the_command_quietly(arguments, folder):
    if arguments[0] == "report":
        subprocess.run(
            program("run", "--no-prove", "good.yaml", "-q"), stdout=subprocess.DEVNULL, check=True
        )
        arguments = (*arguments, "results/good.h5")
    reader, writer = os.pipe()
    os.close(reader)
    done = subprocess.run(program(*arguments), stdout=writer, stderr=subprocess.PIPE, check=False)
    os.close(writer)
    assert done.stderr == b""
    assert done.returncode == 141


FULL = Path("/dev/full")


@pytest.mark.skipif(not FULL.exists(), reason="no such device here")
@pytest.mark.parametrize("arguments", [("schema",), ("--help",), ("check", "good.yaml")])
def test_output_that_cannot_be_written_is_told(arguments, folder):
    with FULL.open("w") as full:
        done = subprocess.run(
            program(*arguments), stdout=full, stderr=subprocess.PIPE, text=True, check=False
        )
    assert done.returncode == 4
    assert done.stderr == "error: the output cannot be written: No space left on device\n"


@pytest.mark.skipif(sys.platform == "win32", reason="its shell cannot close streams like this")
@pytest.mark.parametrize("closed", ["<&-", ">&-", "2>&-", "<&- >&- 2>&-"])
def test_a_command_needs_no_streams(closed, folder):
    shell = [
        "/bin/sh",
        "-c",
        f'exec "$@" {closed}',
        "sh",
        *program("run", "--no-prove", "good.yaml"),
    ]
    done = subprocess.run(shell, capture_output=True, text=True, check=False)
    assert done.returncode == 0
    assert "Traceback" not in done.stderr
    assert Path("results/good.h5").exists()
