"""Protects `rbstab report`: formats, unreadable files, hostile texts, files it may not replace."""

import json
import shutil
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest
import yaml
from cli.conftest import Invoke
from support.made_runs import PEAKS, made_config, made_file
from support.printed_paths import printed, words_of
from support.sweeps import FakeEngine, plan_of

from rbstab.sweep.options import SweepOptions
from rbstab.sweep.sweep import sweep_to_folder


@pytest.fixture
def runs(folder: Path) -> list[str]:
    """The results of two runs, in the working folder."""
    return [
        str(made_file(Path(f"{name}.h5"), made_config(f"body.mass={mass}")))
        for name, mass in (("light", 40), ("heavy", 50))
    ]


@pytest.fixture
def sweep(folder: Path) -> str:
    """The folder of a sweep."""
    sweep_to_folder(plan_of(60), Path("plan"), SweepOptions(FakeEngine, 1, 30))
    return "plan"


def tables(data: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """Return the tables of a JSON report by name."""
    return {
        block["name"]: block
        for section in data["sections"]
        for block in section["blocks"]
        if block["kind"] == "table"
    }


def test_a_page_by_default(runs: list[str], rbstab: Invoke) -> None:
    done = rbstab("report", *runs)
    assert done.exit_code == 0, done.stderr
    assert done.stdout == ""
    assert done.stderr == printed("-> results/report.html\n")
    page = Path("results/report.html").read_text().replace("<wbr>", "")
    for word in ("light", "heavy", "body.mass", "rbstab report light.h5 heavy.h5"):
        assert word in page


@pytest.mark.parametrize(
    ("name", "begin"),
    [
        ("r.html", b"<!doctype html>"),
        ("r.txt", b"Mine"),
        pytest.param("r.md", b"# Mine", marks=pytest.mark.slow),
        pytest.param("r.pdf", b"%PDF-", marks=pytest.mark.slow),
    ],
)
def test_the_format_by_the_name(name: str, begin: bytes, runs: list[str], rbstab: Invoke) -> None:
    assert rbstab("report", runs[0], "-o", name, "--title", "Mine").exit_code == 0
    assert Path(name).read_bytes().lower().startswith(begin.lower())


def test_the_format_by_its_option(runs: list[str], rbstab: Invoke) -> None:
    options = ["--format", "text", "-o", "report.doc"]
    assert rbstab("report", *runs, *options).exit_code == 0
    assert Path("report.doc").read_text().startswith("2 runs")


def test_text_goes_to_stdout_in_80_columns(runs: list[str], rbstab: Invoke) -> None:
    done = rbstab("report", *runs, "--format", "text")
    assert done.exit_code == 0
    assert max(map(len, done.stdout.splitlines())) <= 80
    assert f"{PEAKS[0]:g}" in done.stdout
    assert not Path("results").exists()


def test_json(runs: list[str], rbstab: Invoke) -> None:
    done = rbstab("report", *runs, "--json", "--title", "Mine")
    assert done.exit_code == 0
    assert not Path("results").exists()
    data = json.loads(done.stdout)
    assert data["title"] == "Mine"
    found = tables(data)
    labels = [column["label"] for column in found["runs"]["columns"]]
    units = [column["unit"] for column in found["runs"]["columns"]]
    at = labels.index("peak E1")
    assert units[at] == "m"
    assert [row[at] for row in found["runs"]["rows"]] == pytest.approx([PEAKS[0]] * 2)
    assert found["differences"]["rows"] == [["body.mass [kg]", 40.0, 50.0]]


def test_the_command_makes_the_same_report_again(folder: Path, rbstab: Invoke) -> None:
    made_file(Path("-a b.h5"))
    for arguments in (("--json",), ("--json", "-o", "r.md"), ("--json", "--title", "It's")):
        made = json.loads(rbstab("report", "./-a b.h5", *arguments).stdout)
        words = words_of(made["command"])
        assert words[0] == "rbstab"
        again = json.loads(rbstab(*words[1:]).stdout)
        assert again["command"] == made["command"]
        assert again["title"] == made["title"]


def test_the_command_names_a_whole_folder_by_a_pattern(folder: Path, rbstab: Invoke) -> None:
    """The pattern appears only for all files of the folder in their order."""
    parent = Path("my runs")
    parent.mkdir()
    names = [str(made_file(parent / f"{number}.h5")) for number in range(9)]
    pattern = "rbstab report 'my runs'/*.h5 --format text"
    for given, expected in ((names, True), (names[:8], False), ([*names[1:], names[0]], False)):
        text = " ".join(rbstab("report", *given, "--format", "text").stdout.split())
        assert (pattern in text) == expected
        assert ("made by rbstab report 'my runs/" in text) != expected


def test_runs_and_sweeps_together(runs: list[str], sweep: str, rbstab: Invoke) -> None:
    done = rbstab("report", runs[0], sweep, runs[1], "--json")
    assert done.exit_code == 0, done.stderr
    data = json.loads(done.stdout)
    assert data["title"] == "2 runs and 1 sweep"
    names = [section["name"] for section in data["sections"]]
    assert names.index("summary") < names.index("sweep-1") < names.index("provenance")


def test_what_cannot_be_read_is_said_and_the_rest_reported(runs: list[str], rbstab: Invoke) -> None:
    content = bytearray(Path("light.h5").read_bytes())
    content[len(content) // 3] ^= 255
    Path("damaged.h5").write_bytes(bytes(content))
    Path("none").mkdir()
    others = ("good.yaml", "no.h5", "none")
    done = rbstab("report", "damaged.h5", *runs, *others, "--json", "-o", "r.txt")
    assert done.exit_code == 4
    data = json.loads(done.stdout)
    assert [unread["path"] for unread in data["unread"]] == [
        "damaged.h5",
        "good.yaml",
        "no.h5",
        "none",
    ]
    assert [row[0] for row in tables(data)["runs"]["rows"]] == ["light", "heavy"]
    text = Path("r.txt").read_text()
    for unread in data["unread"]:
        assert f"{unread['path']}: {unread['reason']}" in done.stderr
        assert unread["path"] in text


def test_a_report_is_replaced_and_nothing_else(runs: list[str], rbstab: Invoke) -> None:
    assert rbstab("report", *runs, "-o", "r.txt").exit_code == 0
    assert rbstab("report", runs[0], "-o", "r.txt").exit_code == 0
    shutil.copy("good.yaml", "good.txt")
    done = rbstab("report", *runs, "-o", "good.txt")
    assert done.exit_code == 4
    assert "good.txt already exists and is not a report. Use --force to replace it." in done.stderr
    assert Path("good.txt").read_text() == Path("good.yaml").read_text()
    assert rbstab("report", *runs, "-o", "good.txt", "--force").exit_code == 0


HOSTILE = "<img src=x onerror=alert(1)> **b** [red]r[/red] | `c` $x$ \x1b[31m \u202e&lt;"


class Tags(HTMLParser):
    """The tags of a page and their attributes, outside of its scripts."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.images = 0
        self.handlers: list[str] = []
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.images += tag == "img"
        self.handlers += [name for name, _ in attrs if name.startswith("on")]


@pytest.fixture
def hostile(folder: Path) -> str:
    """A result with hostile markup in every text."""
    words = HOSTILE.replace("\x1b", "").replace("\u202e", "")
    reference = {"source": words, "note": words, "final": {"orientation": [0, 0, 0]}}
    names = ("title", "variant", "status_detail", "verdict", "warnings", "commit", "created")
    attributes = dict.fromkeys((*names, "<b>of</b> *mine*"), HOSTILE)
    path = made_file(
        Path("<b>a</b>|`[x](y).h5"), made_config(reference=reference), status=HOSTILE, **attributes
    )
    return str(path)


def test_foreign_words_are_words_in_a_page(hostile: str, rbstab: Invoke) -> None:
    assert rbstab("report", hostile, "-o", "r.html", "--title", HOSTILE).exit_code == 0
    page = Path("r.html").read_text()
    tags = Tags(page)
    assert (tags.images, tags.handlers) == (0, [])
    assert "&lt;img src=x onerror=alert(1)&gt;" in page
    assert not {"\x1b", "\u202e"} & set(page)


@pytest.mark.parametrize("form", ["text", "json"])
def test_foreign_words_are_words_on_a_terminal(form: str, hostile: str, rbstab: Invoke) -> None:
    options = ["--json"] if form == "json" else ["--format", "text"]
    done = rbstab("report", hostile, *options, "--title", HOSTILE)
    assert done.exit_code == 0
    assert not {"\x1b", "\u202e"} & set(done.stdout)
    assert "[red]r[/red]" in done.stdout


@pytest.mark.slow
@pytest.mark.parametrize("name", ["r.md", "r.pdf"])
def test_foreign_words_do_not_break_the_other_formats(
    name: str, hostile: str, rbstab: Invoke
) -> None:
    assert rbstab("report", hostile, "-o", name, "--title", HOSTILE).exit_code == 0


def test_the_stored_config_repeats_a_run(folder: Path, rbstab: Invoke) -> None:
    assert rbstab("run", "--no-prove", "good.yaml").exit_code == 0
    shown = rbstab("show", "results/good.h5", "--config")
    assert shown.exit_code == 0
    Path("again.yaml").write_text(shown.stdout)
    assert yaml.safe_load(shown.stdout)["title"] == "A short run"
    assert rbstab("run", "--no-prove", "again.yaml", "-o", "again").exit_code == 0
    ids = [
        json.loads(rbstab("show", name, "--json").stdout)["run_id"]
        for name in ("results/good.h5", "again/again.h5")
    ]
    assert ids[0] == ids[1]


PLAIN_INSTALL = """
import sys
for name in ("typst", "vl_convert"):
    sys.modules[name] = None  # as if it were not installed
from rbstab_cli.main import main
main()
"""


@pytest.mark.parametrize(("form", "package"), [("md", "vl-convert-python"), ("pdf", "typst")])
def test_a_plain_install_names_the_package_that_a_format_needs(
    runs: list[str], form: str, package: str
) -> None:
    done = plain_install(runs, "--format", form)
    assert done.returncode == 2
    assert package in done.stderr
    assert 'pip install "rbstab[report]"' in done.stderr
    assert "Traceback" not in done.stderr


def test_a_plain_install_reports_as_a_page_and_as_text(runs: list[str], tmp_path: Path) -> None:
    done = plain_install(runs, "--format", "text")
    assert done.returncode == 0, done.stderr
    assert "completed" in done.stdout
    done = plain_install(runs, "-o", str(tmp_path / "report.html"))
    assert done.returncode == 0, done.stderr
    assert "vegaEmbed" in (tmp_path / "report.html").read_text(encoding="utf-8")


def plain_install(runs: list[str], *arguments: str) -> "subprocess.CompletedProcess[str]":
    """Calls `rbstab report` where the packages of the extra `report` cannot be imported."""
    return subprocess.run(
        [sys.executable, "-c", PLAIN_INSTALL, "report", *runs, *arguments],
        capture_output=True,
        text=True,
        check=False,
    )
