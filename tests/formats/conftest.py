import pytest
from support.configs import EMBEDDED, FREE, PERMANENT, VISCO_ELASTIC, edited, plain

from rbstab.config.load import load_config
from rbstab.experiment.simulate import simulate
from rbstab.store.run_file import write_result

# Short: what a file holds does not depend on how long the motion was followed.
SHORT = ("integration.duration=0.02", "integration.samples=5", "integration.rtol=1e-9")

KINDS = {
    "free": FREE,
    "permanent": PERMANENT,
    "manifold": PERMANENT + "  coordinates: manifold\n  drift_control: projection\n",
    "visco-elastic": VISCO_ELASTIC,
    "embedded": EMBEDDED,
    "compiled": VISCO_ELASTIC + "  engine: heyoka\n",
    "stopped": edited("orientation: [0, 0, 0]", "orientation: [0, 1.5705, 0]"),
}


@pytest.fixture(scope="session")
def runs(tmp_path_factory):
    """A short run of every kind, as it was computed and the file it was written to."""
    folder = tmp_path_factory.mktemp("runs")
    found = {}
    for kind, text in KINDS.items():
        result = simulate(load_config(plain(text), SHORT))
        path = folder / f"{kind}.h5"
        write_result(path, result)
        found[kind] = (result, path)
    return found


@pytest.fixture(params=KINDS)
def kind(request):
    return request.param


@pytest.fixture
def run(runs, kind):
    """One of the runs: the result in memory, and its file."""
    return runs[kind]
