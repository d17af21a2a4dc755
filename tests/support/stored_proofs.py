"""Proofs of stored runs, made once and stored beside copies of them; sweeps with proved members."""

from dataclasses import replace
from functools import cache

from rbstab.experiment.proof import prove
from rbstab.experiment.proof_cache import proof_file
from rbstab.experiment.stored_run import stored_config
from rbstab.store.dataset_file import write_dataset
from rbstab.store.document import write_document
from rbstab.store.result import open_result
from rbstab.store.table import read_table
from rbstab.sweep.folder.sweep_table import MEMBERS
from rbstab.sweep.proofs.columns import CONVERGENCE


@cache
def _proof_of(run):
    config = stored_config(open_result(run)).config
    assert config is not None
    return prove(config)


def store_proof_of(run, folder):
    """Store a proof of the config of a stored run in a folder of results; return its file."""
    config = stored_config(open_result(run)).config
    assert config is not None
    path = proof_file(folder, config)
    path.parent.mkdir(exist_ok=True)
    write_document(path, _proof_of(run.resolve()).model_dump(mode="json"))
    return path


def say_proved(sweep, members):
    """Say in the members file of a sweep that these members converge to rest state 1."""
    file = sweep / "members.h5"
    table = read_table(file, MEMBERS)
    arrays = {name: table[name].copy() for name in ("convergence", "proved_rest_state")}
    for member in members:
        arrays["convergence"][member] = CONVERGENCE.index("proved")
        arrays["proved_rest_state"][member] = 1
    changed = {name: table.variables[name]._replace(data=data) for name, data in arrays.items()}
    write_dataset(file, replace(table, variables={**table.variables, **changed}), replace=True)
