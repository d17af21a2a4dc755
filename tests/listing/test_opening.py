"""Protects what the functions of Python say of a healthy file of another kind."""

import shutil
from pathlib import Path

import pytest
import yaml
from support.results import flip
from support.stored_proofs import store_proof_of

import rbstab
from rbstab.store.errors import NotAResultError, StoreError

STORED = Path(__file__).parents[1] / "formats/data/format_1"

SWEEP = STORED / "sweeps/finished_variants"

CONFIG = """\
title: A body
body: {mass: 41, inertia: [10, 8, 0.4], contact_point: [0, 0, -0.42]}
controller: {variant: permanent, K_t: [1, 1, 1], L_t: [1, 1, 1], K_r: [1, 1, 1], L_r: [1, 1, 1]}
integration: {duration: 1}
"""

PLAN = "base: a.yaml\nvary: {body.mass: {values: [40, 41]}}\n"


@pytest.fixture
def place(tmp_path, monkeypatch):
    """A working folder with a file of each kind."""
    monkeypatch.chdir(tmp_path)
    shutil.copytree(SWEEP, "sweep")
    store_proof_of(STORED / "runs/range_left.h5", tmp_path)
    shutil.copy(SWEEP / "members.h5", "alone.h5")
    shutil.copy(STORED / "runs/embedded.h5", "run.h5")
    Path("a.yaml").write_text(CONFIG)
    Path("plan.yaml").write_text(PLAN)
    Path("none").mkdir()
    return tmp_path


OTHERS = [
    ("sweep", "a sweep", "rbstab.open_sweep('sweep')"),
    ("sweep/members.h5", "a sweep", "rbstab.open_sweep('sweep/members.h5')"),
    ("sweep/shards/00000000.h5", "a part of a sweep", "rbstab.open_sweep('sweep')"),
    ("sweep/traces", "a part of a sweep", "rbstab.open_sweep('sweep')"),
    ("sweep/manifest.json", "a part of a sweep", "rbstab.open_sweep('sweep')"),
    ("proofs/within-1.json", "a proof within tolerances", "`rbstab show` prints it"),
    ("a.yaml", "a config", "rbstab.simulate('a.yaml')"),
    ("plan.yaml", "the plan of a sweep", "rbstab.load_plan('plan.yaml')"),
    (".", "a folder", "The results in it: alone.h5, run.h5, sweep."),
    ("none", "a folder without results", "Name the file of a run"),
    ("proofs", "a folder of proofs", "Name one of its files."),
]


def proof_in(place):
    """Return the only stored proof, as named from the working folder."""
    (file,) = (place / "proofs").glob("*.json")
    return file.relative_to(place)


def check_no_run(name, what, hint):
    with pytest.raises(NotAResultError) as caught:
        rbstab.open_result(name)
    assert str(caught.value).startswith(f"{Path(name)} is {what}, not the result of a run. ")
    assert hint in str(caught.value)


@pytest.mark.parametrize(("name", "what", "hint"), OTHERS)
def test_what_is_no_run(place, name, what, hint):
    if "within" in name:
        Path(name).write_text("{}")
    check_no_run(name, what, hint)


def test_json_elsewhere_is_not_taken_for_a_proof(place):
    Path("notes.json").write_text("{}")
    with pytest.raises(StoreError) as caught:
        rbstab.open_result("notes.json")
    assert "proof" not in str(caught.value)


def test_a_proof_is_no_run(place):
    name = proof_in(place).as_posix()
    check_no_run(name, "a proof of rest states", f"rbstab.open_proof('{name}')")


@pytest.mark.parametrize("function", [rbstab.open_sweep, rbstab.open_proof])
def test_a_run_is_no_sweep_and_no_proof(place, function):
    with pytest.raises(NotAResultError, match=r"is the result of a run, not a .*open_result\('run"):
        function("run.h5")


def test_what_is_named_opens(place):
    assert rbstab.open_result("run.h5").status == "completed"
    assert len(rbstab.open_sweep("sweep")["run"]) == 20
    assert len(rbstab.open_sweep("sweep/members.h5")["run"]) == 20
    file = proof_in(place)
    assert rbstab.open_proof(file).id == file.stem


def test_a_members_file_alone_is_no_sweep(place):
    with pytest.raises(NotAResultError, match=r"^alone\.h5 is what is known of the members of a s"):
        rbstab.open_result("alone.h5")
    with pytest.raises(
        NotAResultError, match=r"^alone\.h5 lacks the rest of its sweep: open the f"
    ):
        rbstab.open_sweep("alone.h5")


@pytest.mark.parametrize("function", [rbstab.open_result, rbstab.open_sweep, rbstab.open_proof])
def test_damaged_and_missing_files_keep_their_errors(place, function):
    flip(Path("run.h5"))
    with pytest.raises(StoreError, match=r"run\.h5 is damaged"):
        function("run.h5")
    with pytest.raises(StoreError, match="cannot be read: No such file"):
        function("shards/missing.h5")


def test_an_unfinished_sweep_is_called_so(place):
    Path("sweep/members.h5").unlink()
    with pytest.raises(StoreError, match="is a sweep that is not finished"):
        rbstab.open_sweep("sweep")


def test_other_things_in_place_of_a_config(place):
    with pytest.raises(rbstab.ConfigError) as caught:
        rbstab.simulate("plan.yaml")
    assert str(caught.value).startswith("plan.yaml:1:1: is the plan of a sweep (expected a config")
    with pytest.raises(rbstab.ConfigError, match="is an HDF5 file, as results are"):
        rbstab.prove("run.h5")
    with pytest.raises(rbstab.ConfigError, match=r"a.yaml:1:1: is a config \(expected a plan"):
        rbstab.load_plan("a.yaml")
    with pytest.raises(TypeError, match=r"the config is 5 \(expected the path of a YAML file"):
        rbstab.simulate(5)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="the config is a Result"):
        rbstab.prove(rbstab.open_result("run.h5"))  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="the plan is 5"):
        rbstab.load_plan(5)  # type: ignore[arg-type]


@pytest.mark.parametrize("text", [CONFIG, CONFIG * 100, "a:\n  b\n"])
def test_the_text_of_a_config_is_not_taken_for_a_path(place, text):
    expected = (
        ":1:1: is a text that looks like YAML, and not the path of a file (expected the path of a "
        "YAML file, or a dictionary, as from yaml.safe_load(text))"
    )
    for kind, function in (
        *(("config", reader) for reader in (rbstab.simulate, rbstab.prove, rbstab.load_config)),
        ("plan", rbstab.load_plan),
    ):
        with pytest.raises(rbstab.ConfigError) as caught:
            function(text)
        assert str(caught.value) == f"{kind}{expected}"


def test_unusual_paths_are_paths(place):
    Path("a: b").write_text(CONFIG)
    assert rbstab.load_config("a: b").title == "A body"
    with pytest.raises(rbstab.ConfigError, match="cannot be read: No such file"):
        rbstab.load_config("a: c.yaml")


def test_a_loaded_plan_is_loaded_again_with_changes(place):
    plan = rbstab.load_plan("plan.yaml")
    assert rbstab.load_plan(plan) is plan
    changed = rbstab.load_plan(plan, ["gravity=[0,0,-9.81]"])
    assert changed.base_of("permanent").gravity == (0, 0, -9.81)
    assert changed.members == plan.members
    assert plan.base_of("permanent").gravity == (0, 0, 0)


def test_configs_and_plans_show_one_line(place):
    data = yaml.safe_load(CONFIG) | {"title": "Two\nlines"}
    config = rbstab.load_config(data)
    assert repr(config) == '<rbstab.Config "Two\\nlines": permanent, 1 s, engine scipy>'
    assert str(config) == repr(config)
    plan = rbstab.load_plan("plan.yaml")
    assert repr(plan) == '<rbstab.Plan "untitled": 2 members, permanent, varies body.mass>'


def test_arguments_of_another_type_are_named(place):
    with pytest.raises(TypeError, match=r"proof: is the text 'x' \(expected what rbstab.prove"):
        rbstab.simulate("a.yaml", proof="x")  # type: ignore[arg-type]
    with pytest.raises(TypeError, match=r"enclose: is the text 'all' \(expected one of rbstab.Enc"):
        rbstab.simulate("a.yaml", enclose="all")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"needs a proof \(expected proof=rbstab.prove\(config\)"):
        rbstab.simulate("a.yaml", enclose=rbstab.Enclose.TO_END)
    with pytest.raises(TypeError, match="the result is of type str"):
        rbstab.write_result("b.h5", "a.yaml")  # type: ignore[arg-type]
    with pytest.raises(rbstab.ConfigError, match="body: is an object"):
        rbstab.simulate({"body": object()})
