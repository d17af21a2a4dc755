"""Protects the messages about a file or an option that is not what a command takes: they say what
it is and name the command that takes it.
"""

from pathlib import Path

import pytest
from cli.conftest import GOOD, Invoke
from support.printed_paths import words_of

from rbstab.files.shell_words import shell_word

PLAN = """\
title: Two members
base: good.yaml
vary:
  initial.angular_velocity[0]: {linspace: [1, 2, 2]}
"""

BLANK = "with a blank"


@pytest.fixture
def files(folder: Path) -> Path:
    """A config and a plan in the working folder, and both in a folder with a blank in its name."""
    (folder / BLANK).mkdir()
    for place in (folder, folder / BLANK):
        (place / "good.yaml").write_text(GOOD)
        (place / "plan.yaml").write_text(PLAN)
    return folder


@pytest.mark.parametrize("file", ["good.yaml", "plan.yaml", f"{BLANK}/good.yaml"])
@pytest.mark.parametrize(
    "command", [["plot"], ["report"], ["compare", "RESULT"], ["compare"], ["show"]]
)
def test_a_config_in_place_of_a_result(
    files: Path, rbstab: Invoke, command: list[str], file: str
) -> None:
    what, verb = ("the plan of a sweep", "sweep") if "plan" in file else ("a config", "run")
    rbstab("run", "good.yaml", "--no-prove", "-q")
    words = [word.replace("RESULT", "results/good.h5") for word in command]
    others = ["results/good.h5"] if command == ["compare"] else []
    done = rbstab(*words, file, *others)
    assert done.exit_code in (2, 4)
    assert f"is {what}, not a result. Run it: rbstab {verb} {shell_word(Path(file))}" in done.stderr
    assert "damaged" not in done.stderr


@pytest.mark.parametrize("command", ["plot", "report", "show", "compare", "verify"])
@pytest.mark.parametrize(("text", "verb"), [(GOOD, "run"), (PLAN, "sweep")], ids=["config", "plan"])
def test_a_config_of_any_name(
    folder: Path, rbstab: Invoke, command: str, text: str, verb: str
) -> None:
    """A config is called so although its name does not end in .yaml."""
    what = {"run": "a config", "sweep": "the plan of a sweep"}[verb]
    Path("mine.txt").write_text(text)
    done = rbstab(command, *["mine.txt"] * (2 if command == "compare" else 1))
    assert done.exit_code in (2, 4)
    assert f"mine.txt is {what}, not a" in done.stderr.replace("mine.txt: ", "mine.txt ")
    assert "damaged" not in done.stderr
    if command != "verify":
        assert f"Run it: rbstab {verb} mine.txt" in done.stderr
    elif verb == "run":
        assert "Prove it: rbstab stability mine.txt" in done.stderr


def test_another_text_is_no_config(folder: Path, rbstab: Invoke) -> None:
    Path("notes.txt").write_text("some: notes\n")
    done = rbstab("show", "notes.txt")
    assert done.exit_code == 4
    assert "notes.txt has no seal of rbstab" in done.stderr


def test_a_folder_without_results_says_how_to_get_one(folder: Path, rbstab: Invoke) -> None:
    Path("my results/proofs").mkdir(parents=True)
    message = "is a folder, but not a sweep, and no result is in it; `rbstab run CONFIG -o"
    assert f"my results: {message} 'my results'` stores one\n" in (
        rbstab("report", "my results").stderr
    )
    assert message in rbstab("compare", "my results", "my results").stderr


def test_the_named_command_works(files: Path, rbstab: Invoke) -> None:
    message = rbstab("plot", f"{BLANK}/good.yaml").stderr
    _, *words = words_of(message.partition("Run it: ")[2])
    assert rbstab(*words, "--no-prove", "-q").exit_code == 0


def test_a_report_shows_the_results_beside_a_config(files: Path, rbstab: Invoke) -> None:
    rbstab("run", "good.yaml", "--no-prove", "-q")
    done = rbstab("report", "results/good.h5", "good.yaml", "--format", "text")
    assert done.exit_code == 4
    assert "good.yaml: is a config, not a result" in done.stderr
    assert "A short run" in done.stdout


@pytest.mark.parametrize(
    ("command", "wanted"), [("run", "config"), ("sweep", "plan"), ("check", "config")]
)
def test_a_result_in_place_of_a_config(
    files: Path, rbstab: Invoke, command: str, wanted: str
) -> None:
    rbstab("run", "good.yaml", "--no-prove", "-q", "-o", BLANK)
    file = Path(BLANK, "good.h5")
    done = rbstab(command, str(file))
    assert done.exit_code == 2
    assert done.stderr == (
        f"{file}:1:1: is the file of a result (expected a {wanted}; look at it: "
        f"rbstab show {shell_word(file)})\n"
    )


def test_a_proof_in_place_of_a_result(files: Path, rbstab: Invoke) -> None:
    rbstab("stability", "good.yaml", "--no-run")
    (proof,) = Path("results/proofs").glob("*.json")
    done = rbstab("plot", str(proof))
    assert done.exit_code == 4
    assert f"is a proof, not a result. Look at it: rbstab show {proof}" in done.stderr


@pytest.mark.parametrize(
    ("file", "message"),
    [
        ("good.yaml", "is a config, not a proof. Prove it: rbstab stability good.yaml. Proofs are"),
        ("plan.yaml", "is the plan of a sweep, not a proof. Proofs are the files in DIR/proofs"),
        (
            "results/good.h5",
            f"{Path('results/good.h5')} is a result, not a proof. Proofs are the files in",
        ),
    ],
)
def test_what_is_no_proof(files: Path, rbstab: Invoke, file: str, message: str) -> None:
    rbstab("run", "good.yaml", "--no-prove", "-q")
    done = rbstab("verify", file)
    assert done.exit_code == 2
    assert message in done.stderr
    assert "damaged" not in done.stderr


def test_a_yaml_file_that_cannot_be_read(files: Path, rbstab: Invoke) -> None:
    Path("a.yaml").write_text("a: [")
    assert "a.yaml is a YAML file, not a result" in rbstab("show", "a.yaml").stderr


def test_a_file_in_place_of_a_folder(files: Path, rbstab: Invoke) -> None:
    done = rbstab("list", f"{BLANK}/good.yaml")
    assert done.exit_code == 4
    expected = f"is a file. List the folder it is in: rbstab list '{BLANK}'"
    assert expected in done.stderr


@pytest.mark.parametrize("turned", [False, True])
def test_a_run_and_a_sweep_are_named_in_their_order(
    files: Path, rbstab: Invoke, turned: bool
) -> None:
    rbstab("run", "good.yaml", "--no-prove", "-q")
    rbstab("sweep", "plan.yaml", "--no-prove", "-q", "--engine", "scipy")
    paths = ["results/good.h5", "results/plan"]
    done = rbstab("compare", *(reversed(paths) if turned else paths))
    assert done.exit_code == 4
    run, sweep = "results/good.h5 is a run", "results/plan is a sweep"
    first, second = (sweep, run) if turned else (run, sweep)
    assert f"{first} and {second}, which have no common outcomes" in done.stderr


def test_plans_are_checked_too(files: Path, rbstab: Invoke) -> None:
    done = rbstab("check", "plan.yaml", "good.yaml")
    assert done.exit_code == 0
    plan, config = done.stdout.splitlines()
    assert plan.startswith("plan.yaml: valid: the plan of a sweep, 2 members, free, sweep id ")
    assert config.startswith("good.yaml: valid: free, coordinates Z")
    Path("wrong.yaml").write_text(PLAN.replace("initial.angular", "initial.anglar"))
    Path("bad.yaml").write_text(GOOD.replace("mass: 41", "mass: -41"))
    done = rbstab("check", "wrong.yaml", "bad.yaml", "good.yaml")
    assert done.exit_code == 2
    assert done.stdout == ""
    first, second = done.stderr.splitlines()
    assert first.startswith("wrong.yaml:4:3: vary.initial.anglar_velocity[0]: is not in the base")
    assert second.startswith("bad.yaml:2:14: body.mass: is -41")


def test_a_problem_of_a_change_is_printed_once(files: Path, rbstab: Invoke) -> None:
    done = rbstab("check", "plan.yaml", "good.yaml", "--set", "body.mass=-1")
    assert done.exit_code == 2
    assert len(done.stderr.splitlines()) == 1


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["sweep", "plan.yaml", "--engine", "heyoke"], "Did you mean heyoka?"),
        (["report", "x.h5", "--format", "htm"], "Did you mean html?"),
        (["tune", "good.yaml", "--objective", "setling"], "Did you mean settling_time?"),
        (["prove"], "No such command 'prove'. Did you mean stability?"),
        (["plan.yaml"], "plan.yaml is not a command. Run this plan: rbstab sweep plan.yaml"),
        ([f"{BLANK}/plan.yaml"], f"Run this plan: rbstab sweep '{BLANK}/plan.yaml'"),
        (["a.h5"], "a.h5 is not a command. Look at this result: rbstab show a.h5"),
    ],
)
def test_a_misspelt_word(files: Path, rbstab: Invoke, words: list[str], message: str) -> None:
    done = rbstab(*words)
    assert done.exit_code == 2
    assert message in done.stderr


def test_a_misspelt_figure(files: Path, rbstab: Invoke) -> None:
    rbstab("run", "good.yaml", "--no-prove", "-q")
    done = rbstab("plot", "results/good.h5", "--figure", "run-1-enrgy", "-o", "a.csv")
    assert done.exit_code == 2
    assert "did you mean run-1-energy?" in done.stderr


def test_the_target_of_a_figure_is_checked_before_results_are_read(
    files: Path, rbstab: Invoke
) -> None:
    Path("a.csv").write_text("mine")
    done = rbstab("plot", "none.h5", "--figure", "run-1-energy", "-o", "a.csv")
    assert "a.csv" in done.stderr
    assert "none.h5" not in done.stderr
    assert Path("a.csv").read_text() == "mine"


def test_the_next_command_of_a_template_is_quoted(files: Path, rbstab: Invoke) -> None:
    done = rbstab("init", "--element", f"{BLANK}/mine.py")
    assert f"Next: rbstab check --element '{BLANK}/mine.py'" in done.stderr


LARGEST = "--largest-within"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (
            [LARGEST, "K_r=±5%"],
            f"{LARGEST} K_r=±5%:1:1: has a size, which is to be found (expected the key alone: "
            f"{LARGEST} K_r)",
        ),
        (
            [LARGEST, "body.mass=5"],
            f"{LARGEST} body.mass=5:1:1: has a size, which is to be found (expected the key alone: "
            f"{LARGEST} body.mass)",
        ),
        (
            [LARGEST, "mass"],
            f"{LARGEST} mass:1:1: mass has no numbers that can have a tolerance (did you mean "
            "body.mass?)",
        ),
        (
            [LARGEST, "elements"],
            f"{LARGEST} elements:1:1: elements has no numbers that can have a tolerance (expected "
            "a key of body, controller, gravity, initial)",
        ),
        (
            [LARGEST, "gravity"],
            f"{LARGEST} gravity:1:1: is a tolerance of 0, because gravity is 0 (expected a size "
            "above 0)",
        ),
        (
            ["--within", "body=±1%", LARGEST, "body.mass"],
            f"{LARGEST} body.mass:1:1: gives a second tolerance of body.mass (expected one of "
            "them)",
        ),
        (
            ["--within", "controler=±1%"],
            "--within controler=±1%:1:1: controler has no numbers that can have a tolerance (did "
            "you mean controller?)",
        ),
    ],
)
def test_a_wrong_tolerance_names_its_option(
    files: Path, rbstab: Invoke, words: list[str], message: str
) -> None:
    done = rbstab("stability", "good.yaml", *words)
    assert done.exit_code == 2
    assert done.stderr == f"{message}\n"
    assert not Path("results").exists()


def test_search_only_names_the_option_that_was_given(files: Path, rbstab: Invoke) -> None:
    done = rbstab("stability", "good.yaml", "--search-only", LARGEST, "body")
    assert done.exit_code == 2
    assert "--search-only makes no proofs: leave out --largest-within" in done.stderr


def test_the_largest_tolerance_of_a_driven_body_has_a_reason(files: Path, rbstab: Invoke) -> None:
    push = "{push: {kind: input, quantity: couple, direction: [0, 0, 1], amplitude: 3, signal: "
    driven = GOOD + f"schema_version: 2\nelements: {push}{{kind: constant}}}}}}\n"
    Path("driven.yaml").write_text(driven)
    done = rbstab("stability", "driven.yaml", "--no-run", LARGEST, "body.mass")
    assert done.exit_code == 0
    assert "none is proved. At ±0.015625 % it is not decided: an input" in done.stdout
