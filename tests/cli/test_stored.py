"""Protects `rbstab list`, `rbstab compare`, and `rbstab show` of all that is not a run."""

import json
import shutil
import sys
from pathlib import Path

import pytest
from cli.conftest import STORED, ended, json_of, rbstab, success
from support.made_runs import made_file
from support.printed_paths import printed
from support.stored_proofs import store_proof_of

from rbstab_cli.work.stored.list import age


@pytest.fixture(autouse=True)
def results(folder):
    """A copy of stored results in the working folder."""
    shutil.copytree(STORED, "results")
    for path in Path("results/runs").iterdir():
        path.rename(Path("results") / path.name)
    for path in list(Path("results/sweeps").iterdir()):
        path.rename(Path("results") / path.name)
    store_proof_of(STORED / "runs/range_left.h5", Path("results"))
    return Path("results")


@pytest.mark.skipif(sys.platform == "win32", reason="no name has a line break there")
def test_list_names_what_cannot_be_read():
    Path("results/bro\nken.h5").write_text("x")
    done = ended(4, "list")
    assert done.stderr.startswith("results/bro\\nken.h5 has no seal of rbstab: ")
    assert printed("results/embedded.h5") in done.stdout


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(-5, "0 s"), (59.9, "59 s"), (60, "1 min"), (7199, "1 h"), (86400 * 400, "400 d")],
)
def test_ages(seconds, text):
    assert age(seconds) == text


def test_compare_runs():
    done = success("compare", "results/embedded.h5", "results/free_gravity.h5")
    lines = [line.split() for line in done.stdout.splitlines()]
    assert lines[0] == ["config", "key", "embedded.h5", "free_gravity.h5"]
    assert ["controller.variant", "embedded", "free"] in lines
    assert ["outcome", "embedded.h5", "free_gravity.h5", "B/A"] in lines
    assert "v(0) and v(end) have no ratio" in done.stderr


def test_compare_as_json():
    words = ("compare", "results/finished_map", "results/finished_variants", "--json")
    data = json.loads(rbstab(*words).stdout)
    assert data["kind"] == "sweep"
    assert {"name": "design", "first": "grid", "second": "random", "ratio": ""} in data["inputs"]


@pytest.mark.parametrize(
    ("path", "expected"),
    [
        ("finished_map", ["done 30 (100.0%)"]),
        ("finished_map/members.h5", ["done 30 (100.0%)"]),
        ("begun_map", ["not done 14 46.67%"]),
        (
            "proofs/*.json",
            ["kind proof of rest states and their regions", "statements Rest states: "],
        ),
        (".", ["results/embedded.h5 run still moving completed seen"]),
    ],
)
def test_show_of_other_kinds(path, expected):
    (file,) = Path("results").glob(path) if "*" in path else [Path("results") / path]
    done = success("show", str(file))
    lines = [" ".join(line.split()) for line in done.stdout.splitlines()]
    for text in expected:
        assert any(line.startswith(text) for line in lines), done.stdout
    json_of("show", str(file))


@pytest.mark.parametrize(
    ("path", "command"),
    [
        (
            "finished_map",
            "Next: rbstab report results/finished_map\n"
            "Or try to prove a member that is only seen: "
            "rbstab run results/finished_map/plan.yaml --member 2 --prove\n",
        ),
        ("begun_map", "Next: rbstab sweep results/begun_map/plan.yaml\n"),
    ],
)
def test_show_names_the_next_command_of_a_sweep(path, command):
    assert rbstab("show", f"results/{path}").stderr == printed(command)


def test_provenance_has_units_and_no_empty_values(results):
    made_file(results / "made.h5", commit="", wall_time=0.18403063600089808)
    lines = rbstab("show", "results/made.h5").stdout.splitlines()
    rows = {line.split()[0]: line.split()[1:] for line in lines if line.strip()}
    assert rows["wall_time"] == ["0.184", "s"]
    assert rows["commit"] == ["-"]


@pytest.mark.slow
def test_a_list_has_a_line_for_each_result():
    done = success("list")
    lines = [line.split() for line in done.stdout.splitlines()]
    assert lines[0] == [
        "name",
        "kind",
        "outcome",
        "status",
        "checks",
        "this",
        "start",
        "whole",
        "range",
        "age",
        "title",
    ]
    # Its body has a stored proof, also of where all motions end that stay in the range.
    left = "results/range_left.h5 run left the range range left seen not decided returns: proved"
    assert printed(left).split() in [words[:12] for words in lines]
    assert [printed("results/begun_map"), *["sweep", "-", "2", "of", "4", "shards"]] in [
        w[:7] for w in lines
    ]
    assert len(lines) == 1 + 9 + 4 + 2
    files = printed("results/proofs has 1 file; rbstab show results/proofs prints what is proved.")
    assert done.stdout.splitlines()[-1] == files
    data = {entry["path"]: entry for entry in json_of("list")}
    assert len(data) == 9 + 4
    sweep = data[printed("results/finished_map")]
    assert (sweep["status"], sweep["problem"]) == ("30 of 30 completed", None)
    assert sweep["modified"].endswith("+00:00")
