"""Short runs of every kind, as results in memory and as files."""

import pytest
from support.configs import EMBEDDED, FREE, PERMANENT, VISCO_ELASTIC, edited, plain

from rbstab.config.load import load_config
from rbstab.experiment.simulate import simulate
from rbstab.store.result import write_result

# Short runs suffice: the duration of a run does not change the kinds of content of its file.
SHORT = ("integration.duration=0.02", "integration.samples=5", "integration.rtol=1e-9")

KINDS = {
    "free": FREE,
    "permanent": PERMANENT,
    "manifold": PERMANENT + "  coordinates: manifold\n  drift_control: projection\n",
    "visco-elastic": VISCO_ELASTIC,
    "embedded": EMBEDDED,
    "compiled": VISCO_ELASTIC + "  engine: heyoka\n",
    "stopped": edited("orientation: [0, 0, 0]", "orientation: [0, 1.56977, 0]"),
}


@pytest.fixture(scope="session")
def runs(tmp_path_factory):
    """By kind: a short run in memory, and the file of it."""
    folder = tmp_path_factory.mktemp("runs")
    by_kind = {}
    for kind, text in KINDS.items():
        result = simulate(load_config(plain(text), SHORT))
        path = folder / f"{kind}.h5"
        write_result(path, result)
        by_kind[kind] = (result, path)
    return by_kind


@pytest.fixture(params=KINDS)
def kind(request):
    """The kind of the run."""
    return request.param


@pytest.fixture
def run(runs, kind):
    """The run of that kind: the result in memory, and its file."""
    return runs[kind]
