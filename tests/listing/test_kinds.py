"""Protects how files and folders of results are told apart, by their places and names."""

from pathlib import Path

import pytest
from support.stored_proofs import store_proof_of

from rbstab.listing.kinds import Kind, kind_of, sweep_folder_of

STORED = Path(__file__).parents[1] / "formats/data/format_1"

SWEEP = STORED / "sweeps/finished_variants"

KINDS = [
    (STORED, Kind.FOLDER),
    (STORED / "runs", Kind.FOLDER),
    (STORED / "runs/embedded.h5", Kind.RUN),
    (STORED / "runs/missing.h5", Kind.RUN),
    (SWEEP, Kind.SWEEP),
    (SWEEP / "members.h5", Kind.SWEEP),
    (SWEEP / "plan.yaml", Kind.CONFIG),
    (SWEEP / "shards/00000000.h5", Kind.PART),
    (SWEEP / "traces/00000000.h5", Kind.PART),
    (SWEEP / "shards", Kind.PART),
]


def check_kind(path: Path, kind: Kind, monkeypatch: pytest.MonkeyPatch) -> None:
    assert kind_of(path) is kind
    if path.parent.is_dir():
        # A bare name in the working folder has the same kind.
        monkeypatch.chdir(path.parent)
        assert kind_of(Path(path.name)) is kind


@pytest.mark.parametrize(("path", "kind"), KINDS)
def test_kinds(path, kind, monkeypatch):
    check_kind(path, kind, monkeypatch)


def test_the_kind_of_a_proof(tmp_path, monkeypatch):
    check_kind(store_proof_of(STORED / "runs/range_left.h5", tmp_path), Kind.PROOF, monkeypatch)


def test_names_alone_make_no_sweep(tmp_path):
    for name in ("members.h5", "shards/00000000.h5", "traces/00000000.h5", "other/proof.json"):
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.touch()
        assert kind_of(path) is Kind.RUN


@pytest.mark.parametrize("name", ["", "members.h5", "shards/00000000.h5", "traces/00000000.h5"])
def test_the_folder_of_a_sweep(name):
    assert sweep_folder_of(SWEEP / name) == SWEEP
