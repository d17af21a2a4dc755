"""What is proved of the exact motion, with the run or after it, is said alike by every command."""

import json
import shutil
from pathlib import Path

import pytest
from cli.conftest import GOOD, json_of, rbstab, success

OUTSIDE = (
    *("--set", "controller.variant=permanent", "--set", "body.inertia=[10,8,0.4]"),
    *("--set", "initial.angular_velocity=[16,32,-16]", "--set", "integration.duration=0.5"),
)
"""Nearly the first case of the paper, far outside of its certified region."""


@pytest.fixture(scope="module")
def once(tmp_path_factory):
    """The folder of a proved run, and what the command printed."""
    path = tmp_path_factory.mktemp("once")
    (path / "good.yaml").write_text(GOOD)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(path)
        done = rbstab("run", "good.yaml", "--prove", *OUTSIDE)
    return path / "results", done


@pytest.fixture
def proved(folder, once):
    """What the command printed. Its results are in the working folder, as if it had run there."""
    results, done = once
    assert done.exit_code == 0, done.output
    shutil.copytree(results, folder / "results")
    return done


def test_show_says_what_the_run_has_said(proved):
    shown = rbstab("show", "results/good.h5").stdout
    _, *answers = shown.splitlines()[:6]
    assert answers == proved.stdout.strip().splitlines()[-6:-1]
    this_start = (
        "This start:  proved: the exact motion converges to the only rest state in the range: "
        "it is inside the certified region from t = 0.37"
    )
    for text in (this_start, "converges to rest state 1: proved", "J < 1020.4", " steps, "):
        assert text in shown
    assert "convergence_" not in shown


def test_json_has_it_as_one_object(proved):
    data = json_of("show", "results/good.h5")
    convergence = data["convergence"]
    assert convergence["proved"] is True
    assert convergence["rest_state"] == 1
    low, high = convergence["energy"]
    assert 0 < low < high < convergence["bound"]
    assert 0.35 < convergence["time"] < 0.4
    assert convergence["why"] == ""
    assert not any(key.startswith("convergence_") for key in data)
    assert data["verdict"] == "consistent"
    again = json_of("run", "good.yaml", "--prove", *OUTSIDE)
    assert again[0]["convergence"] == convergence
    assert again[0]["computed"] is False
    # A longer enclosure is added, and the run is not integrated again.
    longer = rbstab("run", "good.yaml", "--prove", "--to-end", "--json", *OUTSIDE)
    assert json.loads(longer.stdout)[0]["computed"] is False
    second = json_of("show", "results/good.h5")
    shapes = [facts["arrays"]["enclosure/time"]["shape"][0] for facts in (data, second)]
    assert shapes[0] < shapes[1] == 11


def test_a_printed_value_that_does_not_follow(folder):
    reference = (
        *("--set", "reference.source=a book"),
        *("--set", "reference.final.orientation=[0.09, -0.12, 0.3]"),
    )
    success("run", "good.yaml", "--prove", "--to-end", *OUTSIDE, *reference)
    assert "the printed value does not follow, proved" in rbstab("show", "results/good.h5").stdout
    shown = json_of("show", "results/good.h5")
    # To the end: the motion is enclosed at all 11 samples.
    assert shown["arrays"]["enclosure/time"]["shape"][0] == 11
    rounded = [round(angle, 3) for angle in shown["final"]["orientation"]]
    right = f"reference.final.orientation={rounded}"
    success(
        "run", "good.yaml", "--prove", "--to-end", *OUTSIDE, *reference[:2], "--set", right,
        "-o", "other",
    )  # fmt: skip
    assert "does not follow" not in rbstab("show", "other/good.h5").stdout


def words(text):
    return " ".join(text.split())


@pytest.fixture
def proved_later(folder):
    """A run without a proof, beside the proof of its rest states."""
    success("run", "good.yaml", "--no-prove", "-q")
    success("stability", "good.yaml", "--results", "results")
    return Path("results/good.h5")


def test_show_says_one_thing(proved_later):
    shown = words(rbstab("show", str(proved_later)).stdout)
    assert "This start: proved" in shown
    assert "Whole range: proved" in shown
    assert "global stability proved rest states in the range 1 = 1" in shown
    assert "certified region proved start above rest state 1, J" in shown
    assert "proved to be the only one in the range" in shown
    assert "nothing is proved" not in shown
    assert "no lower one is known" not in shown
    data = json_of("show", str(proved_later))
    assert data["answers"]["this_start"]["word"] == "proved"
    assert data["convergence"]["proved"] is True
    by_check = {line["check"]: line["word"] for line in data["certificate"]}
    assert by_check["certified region"] == by_check["global stability"] == "proved"
    assert data["checks"] == "seen"
    assert data["verdict"] == "consistent"
    (entry,) = json_of("list")
    assert (entry["this_start"], entry["whole_range"]) == ("proved", "returns: proved")
