"""Protects the reading of named files and folders, and the reasons given for unreadable ones."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.configs import VISCO_ELASTIC, plain
from support.made_runs import made_file, made_result
from support.results import flip, result
from support.sweeps import SHORT, FakeEngine, plan_of

from rbstab.report.reading import untrusted
from rbstab.report.reading.sources import MAX_LABEL_LENGTH, read_sources, unique_labels
from rbstab.store.dataset_file import write_dataset
from rbstab.store.disk.seal import SEAL_SIZE
from rbstab.store.result import write_result
from rbstab.store.table import Column, read_table
from rbstab.sweep.folder.sweep_folder import SHARD
from rbstab.sweep.folder.sweep_table import MEMBERS
from rbstab.sweep.options import SweepOptions
from rbstab.sweep.sweep import sweep_to_folder
from rbstab.systems.quantities import QUANTITIES, Quantity


@pytest.fixture(scope="module")
def sweep(tmp_path_factory):
    """The folder of a finished sweep."""
    folder = tmp_path_factory.mktemp("sweeps") / "plan"
    sweep_to_folder(plan_of(60), folder, SweepOptions(FakeEngine, 1, 30))
    return folder


@pytest.fixture
def good(tmp_path):
    """The file of a valid run."""
    return made_file(tmp_path / "good.h5")


def reason(path, good):
    """Read an unreadable path together with a valid run; return the reason for the former."""
    sources = read_sources([path, good])
    assert [run.path for run in sources.runs] == [good]
    [unread] = sources.unread
    assert unread.path == str(path)
    return unread.reason


def test_runs_and_sweeps_in_their_order(tmp_path, sweep):
    runs = [made_file(tmp_path / f"{name}.h5") for name in "cab"]
    sources = read_sources([runs[0], sweep, *runs[1:]])
    assert [(r.number, r.name, r.label) for r in sources.runs] == [
        (0, "run-1", "c"),
        (1, "run-2", "a"),
        (2, "run-3", "b"),
    ]
    assert [(s.number, s.name, s.label) for s in sources.sweeps] == [(0, "sweep-1", "plan")]
    assert sources.sweeps[0].path == sweep / "members.h5"
    assert sources.unread == ()


def test_a_sweep_by_its_file_or_its_folder(tmp_path, sweep):
    copy = shutil.copytree(sweep, tmp_path / "copy")
    sources = read_sources([sweep / "members.h5", copy, str(sweep)])
    assert [s.label for s in sources.sweeps] == ["plan", "copy"]


def test_a_members_file_without_its_shards(good, tmp_path, sweep):
    copy = shutil.copy(sweep / "members.h5", tmp_path / "members.h5")
    expected = "is what is known of the members of a sweep, not the result of a run"
    assert reason(copy, good) == expected
    shutil.copy(sweep / "manifest.json", tmp_path)
    assert reason(copy, good).endswith("00000000.h5 cannot be read: No such file or directory")


def test_what_is_named_twice_is_taken_once(good, tmp_path):
    link = tmp_path / "link.h5"
    link.symlink_to(good)
    assert len(read_sources([good, str(good), link, good.parent / "." / good.name]).runs) == 1


@pytest.mark.parametrize("text", ["a: [", "- 1\n", "title: x\n", "", "controller: 3\n", "\x00"])
def test_a_config_that_cannot_be_read_leaves_the_run(text, tmp_path):
    made = made_result()
    path = tmp_path / "a.h5"
    write_result(path, type(made)(made.variables, made.attributes, text.replace("\x00", "\x01")))
    [run] = read_sources([path]).runs
    assert run.config is None


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (
            lambda c: c[: len(c) // 2] + bytes([c[len(c) // 2] ^ 1]) + c[len(c) // 2 + 1 :],
            "is damaged: its content does not match its digest",
        ),
        (
            lambda c: c.replace(b"\nrbstab format 001", b"\nrbstab format 007"),
            "was written by a newer rbstab; update rbstab",
        ),
        # HDF5 drops what follows its own content.
        (lambda c: c[:-SEAL_SIZE], "has no seal of rbstab"),
    ],
    ids=["damaged", "newer", "changed by another program"],
)
def test_a_file_that_was_changed(change, expected, good, tmp_path):
    path = tmp_path / "a.h5"
    path.write_bytes(change(good.read_bytes()))
    assert reason(path, good).startswith(expected)


def test_a_result_without_the_arrays_of_a_run(good, tmp_path):
    path = tmp_path / "a.h5"
    write_result(path, result())
    assert reason(path, good) == "is damaged: it has no array angular_velocity"


def test_a_file_that_is_older_than_a_quantity_is_read(good, monkeypatch):
    later = Quantity("later", "-", "J", ("time",), "added later", lambda seen: seen.energy[0])
    monkeypatch.setattr(untrusted, "QUANTITIES", (*QUANTITIES, later))
    assert read_sources([good]).unread == ()


def reason_with(variables, good, tmp_path):
    """Return the reason why a run with these arrays is not read."""
    made, path = made_result(), tmp_path / "a.h5"
    write_result(path, type(made)(variables, made.attributes, made.config))
    return reason(path, good)


@pytest.mark.parametrize(
    ("name", "dimensions", "data"),
    [
        ("lyapunov", ("other",), np.zeros(400)),
        ("contact_displacement", ("time", "other"), np.zeros((401, 2))),
        ("energy", ("time",), np.zeros(401)),
        ("orientation", ("time", "axis"), np.array([["x"] * 3] * 401, dtype=object)),
        ("energy_at_rest", ("time",), np.zeros(401)),
        ("part", ("part",), np.zeros(5)),
        ("certificate/verdict", ("other",), np.array(["certified"] * 3, dtype=object)),
        ("certificate/value", ("check",), np.array(["x"] * 7, dtype=object)),
        ("certificate/quantity", ("check",), np.zeros(7)),
    ],
)
def test_arrays_of_other_shapes_and_kinds(name, dimensions, data, good, tmp_path):
    variables = dict(made_result().variables)
    whole = np.arange(data.shape[-1])
    variables["other"] = variables["axis"]._replace(dimensions=("other",), data=whole)
    variables[name] = variables[name]._replace(dimensions=dimensions, data=data)
    expected = f"is damaged: its array {name} has a wrong type or shape"
    assert reason_with(variables, good, tmp_path) == expected


@pytest.mark.parametrize("name", ["members.h5", "shards/00000001.h5"])
def test_a_damaged_sweep(name, good, tmp_path, sweep):
    copy = Path(shutil.copytree(sweep, tmp_path / "copy"))
    flip(copy / name)
    assert reason(copy, good).startswith(f"{copy / name} is damaged: its content does not match")


@pytest.mark.parametrize(
    ("name", "column"),
    [
        ("status", {"dtype": "f8", "flags": ()}),
        ("status", {"dtype": "i8", "flags": ()}),
        ("status", {"flags": ("settled", "completed")}),
        ("status", {"flags": ()}),
        ("settling_time", {"dimensions": ("axis",)}),
        ("peak_time", {"dimensions": ()}),
        ("peak_time", {"dimensions": ("way",), "lengths": (2,)}),
        ("convergence", {"dimensions": ("axis",)}),
        ("convergence", {"dtype": "f8", "flags": ()}),
        ("proved_rest_state", {"dtype": "i8"}),
        ("initial_angular_velocity_0", {"dimensions": ("axis",)}),
    ],
    ids=repr,
)
def test_columns_of_other_shapes_and_kinds(name, column, good, tmp_path, sweep):
    """The seals of the files are right."""
    copy = Path(shutil.copytree(sweep, tmp_path / "copy"))
    path, kind, refused = copy / "shards/00000001.h5", SHARD, "a shard"
    if name not in read_table(path, kind):
        path, kind, refused = copy / "members.h5", MEMBERS, "the members file"
    table = read_table(path, kind)
    stored = table.variables[name]
    kept = stored.dimensions[1:], stored.data.dtype.str, *stored[2:]
    changed = Column(*kept)._replace(**column)
    data = np.zeros((len(table["run"]), *changed.shape), changed.dtype)
    variables = {**table.variables, name: changed.of(data)}
    write_dataset(path, replace(table, variables=variables), replace=True)
    assert reason(copy, good) == f"{path} is not {refused} of this sweep"


def test_the_members_file_of_another_sweep(good, tmp_path, sweep):
    copy, other = tmp_path / "copy", tmp_path / "other"
    shutil.copytree(sweep, copy)
    plan = plan_of(60, base={**plain(VISCO_ELASTIC), "integration": SHORT})
    sweep_to_folder(plan, other, SweepOptions(FakeEngine, 1, 30))
    file = shutil.copy(other / "members.h5", copy)
    assert reason(copy, good) == f"{file} is not the members file of this sweep"


def test_labels_are_the_shortest_that_tell_files_apart():
    paths = [Path(text) for text in ("/r/a/x.h5", "/r/b/x.h5", "/s/b/x.h5", "/r/y.h5")]
    assert unique_labels(paths) == ["a/x", "r/b/x", "s/b/x", "y"]


def test_labels_are_short_and_their_own_whatever_the_files_are_called():
    names = ["\x1b[31m", "\u202egnp", "a" * 200, "a" * 200 + "b", "a" * 200 + "c", "x", "y"]
    labels = unique_labels([Path("/r", f"{name}.h5") for name in names])
    assert len(set(labels)) == len(labels)
    assert all(label.isprintable() for label in labels)
    assert max(map(len, labels)) <= MAX_LABEL_LENGTH + len(" (1)")
