"""Protects `rbstab report`: formats, unreadable files, hostile texts, files it may not replace."""

import json
import shutil
from pathlib import Path

import pytest
from cli.conftest import ended, rbstab, success
from support.made_runs import PEAKS, made_config, made_file
from support.printed_paths import printed, words_of
from support.results import flip


@pytest.fixture
def runs(folder):
    """The results of two runs, in the working folder."""
    return [
        str(made_file(Path(f"{name}.h5"), made_config(f"body.mass={mass}")))
        for name, mass in (("light", 40), ("heavy", 50))
    ]


def tables(data):
    """Return the tables of a JSON report by name."""
    return {
        block["name"]: block
        for section in data["sections"]
        for block in section["blocks"]
        if block["kind"] == "table"
    }


def test_a_page_by_default(runs):
    done = success("report", *runs)
    assert done.stdout == ""
    assert done.stderr == printed("-> results/report.html\n")
    page = Path("results/report.html").read_text().replace("<wbr>", "")
    for word in ("light", "heavy", "body.mass", "rbstab report light.h5 heavy.h5"):
        assert word in page


def test_the_folder_of_results_needs_no_words(folder, monkeypatch):
    made_file(Path("results/run.h5"))
    opened: list[str] = []
    monkeypatch.setattr("click.launch", opened.append)
    assert rbstab("report", "--open").stderr.endswith(printed("-> results/report.html\n"))
    assert opened == [Path("results/report.html").absolute().as_uri()]
    ended(2, "report", "--format", "text", "--open")
    done = rbstab("export")
    assert done.stdout.startswith("-> results.csv: 1 row, ")
    assert Path("results.csv").is_file()


@pytest.mark.parametrize(
    ("name", "begin"),
    [
        ("r.html", b"<!doctype html>"),
        ("r.txt", b"Mine"),
        pytest.param("r.md", b"# Mine", marks=pytest.mark.slow),
        pytest.param("r.pdf", b"%PDF-", marks=pytest.mark.slow),
    ],
)
def test_the_format_by_the_name(name, begin, runs):
    success("report", runs[0], "-o", name, "--title", "Mine")
    assert Path(name).read_bytes().lower().startswith(begin.lower())


def test_text_goes_to_stdout_in_80_columns(runs):
    done = success("report", *runs, "--format", "text")
    assert max(map(len, done.stdout.splitlines())) <= 80
    assert f"{PEAKS[0]:g}" in done.stdout
    assert not Path("results").exists()


def test_json(runs):
    done = success("report", *runs, "--json", "--title", "Mine")
    assert not Path("results").exists()
    data = json.loads(done.stdout)
    assert data["title"] == "Mine"
    by_name = tables(data)
    labels = [column["label"] for column in by_name["runs"]["columns"]]
    units = [column["unit"] for column in by_name["runs"]["columns"]]
    at = labels.index("peak E1")
    assert units[at] == "m"
    assert [row[at] for row in by_name["runs"]["rows"]] == pytest.approx([PEAKS[0]] * 2)
    assert by_name["differences"]["rows"] == [["light", 40.0], ["heavy", 50.0]]


def test_the_command_makes_the_same_report_again(folder):
    made_file(Path("-a b.h5"))
    for arguments in (("--json",), ("--json", "-o", "r.md"), ("--json", "--title", "It's")):
        made = json.loads(rbstab("report", "./-a b.h5", *arguments).stdout)
        words = words_of(made["command"])
        assert words[0] == "rbstab"
        again = json.loads(rbstab(*words[1:]).stdout)
        assert again["command"] == made["command"]
        assert again["title"] == made["title"]


def test_a_report_is_replaced_and_nothing_else(runs):
    success("report", *runs, "-o", "r.txt")
    success("report", runs[0], "-o", "r.txt")
    shutil.copy("good.yaml", "good.txt")
    ended(4, "report", *runs, "-o", "good.txt")
    assert Path("good.txt").read_text() == Path("good.yaml").read_text()
    success("report", *runs, "-o", "good.txt", "--force")


HOSTILE = "<img src=x onerror=alert(1)> **b** [red]r[/red] | `c` $x$ \x1b[31m \u202e&lt;"


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [
        "r.html",
        "r.txt",
        "r.json",
        *(pytest.param(name, marks=pytest.mark.heavy) for name in ("r.md", "r.pdf")),
    ],
)
def test_foreign_words_are_words(name, folder):
    """A result with hostile markup in every text steers neither a page nor a terminal."""
    words = HOSTILE.replace("\x1b", "").replace("\u202e", "")
    reference = {"source": words, "note": words, "final": {"orientation": [0, 0, 0]}}
    names = ("title", "variant", "status", "status_detail", "verdict", "warnings", "commit")
    attributes = dict.fromkeys((*names, "<b>of</b> *mine*"), HOSTILE)
    made = made_file(Path("<b>a</b>|`[x](y).h5"), made_config(reference=reference), **attributes)
    output = ["--json"] if name == "r.json" else ["-o", name]
    done = success("report", str(made), *output, "--title", HOSTILE)
    if name in ("r.html", "r.txt", "r.json"):
        text = done.stdout if name == "r.json" else Path(name).read_text()
        assert not {"\x1b", "\u202e"} & set(text)
        assert "[red]r[/red]" in text
        assert name != "r.html" or ("<img" not in text and "&lt;img src=x onerror" in text)


@pytest.mark.slow
def test_what_cannot_be_read_is_said_and_the_rest_reported(runs):
    flip(Path(shutil.copy("light.h5", "damaged.h5")), share=0.3)
    others = ["damaged.h5", "good.yaml", "no.h5"]
    done = ended(4, "report", *runs, *others, "--json", "-o", "r.txt")
    data = json.loads(done.stdout)
    assert [unread["path"] for unread in data["unread"]] == others
    assert [row[0] for row in tables(data)["runs"]["rows"]] == ["light", "heavy"]
    for unread in data["unread"]:
        assert f"{unread['path']}: {unread['reason']}" in done.stderr
        assert unread["path"] in Path("r.txt").read_text()
