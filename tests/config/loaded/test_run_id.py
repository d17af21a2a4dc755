"""Two configs have the same run id exactly when physics and settings are the same."""

import pytest
from support.configs import EMBEDDED, PERMANENT, VISCO_ELASTIC, edited, plain
from support.fresh_process import printed_with_hash_seeds

from rbstab.config.load import load_config, run_id

HEYOKA = VISCO_ELASTIC + "  engine: heyoka\n"


def test_form():
    name = run_id(load_config(plain()))
    assert len(name) == 32
    assert set(name) <= set("0123456789abcdef")


SAME = [
    (VISCO_ELASTIC, edited("41.0", "41")),
    (VISCO_ELASTIC, edited("41.0", "4.1e1")),
    (VISCO_ELASTIC, edited("41.0", "+041.")),
    (VISCO_ELASTIC, edited("4100, 4100, 3280", "4.1e3, 4100.0, 3280")),
    (VISCO_ELASTIC, edited("orientation: [0, 0, 0]", "orientation: [-0.0, 0.0, -0]")),
    (VISCO_ELASTIC, VISCO_ELASTIC + "gravity: [0, -0.0, 0]\n"),
    (VISCO_ELASTIC, edited("  orientation: [0, 0, 0]\n", "")),
    (VISCO_ELASTIC, edited("[10.0, 8.0, 0.4]", "\n  - 10\n  - 8\n  - 0.4")),
    (VISCO_ELASTIC, edited("title: Case", "title: 'Case'  # a comment")),
    (VISCO_ELASTIC, VISCO_ELASTIC + "schema_version: 1\n"),
    (VISCO_ELASTIC, VISCO_ELASTIC + "reference:\n"),
    (VISCO_ELASTIC, VISCO_ELASTIC + "  engine: scipy\n  method: DOP853\n  rtol: 1e-12\n"),
    (VISCO_ELASTIC, VISCO_ELASTIC + "  time_limit: 600\n"),
    # What is wanted of a motion does not change it.
    (VISCO_ELASTIC, VISCO_ELASTIC + "desired:\n  orientation: [0, 0.5, 0]\n  within: 0.2\n"),
    # Keys without effect.
    (HEYOKA, HEYOKA + "  method: Radau\n"),
    (HEYOKA, HEYOKA + "  atol: 1e-6\n"),
    (PERMANENT, PERMANENT + "  drift_control: none\n"),
]


@pytest.mark.parametrize(("one", "other"), SAME)
def test_same(load, one, other):
    assert one != other
    assert run_id(load(one)) == run_id(load(other))


def test_order_of_keys():
    data = plain()
    turned = {
        key: dict(reversed(value.items())) if isinstance(value, dict) else value
        for key, value in reversed(data.items())
    }
    assert list(turned) != list(data)
    assert run_id(load_config(turned)) == run_id(load_config(data))


CHANGES = [
    "title=Other",
    "body.mass=41.000000000000007",  # the next float
    "body.inertia[2]=0.5",
    "body.inertia=[[10, 0, 0], [0, 8, 0], [0, 0, 0.4]]",
    "body.contact_point[1]=0.11",
    "gravity=[0, 0, -9.81]",
    "controller.K_t[0]=4101",
    "controller.L_t[0]=201",
    "controller.K_r[0]=401",
    "controller.L_r[0]=61",
    "controller.K_c[0]=12301",
    "controller.L_c[0]=601",
    "controller.K_d[0]=12301",
    "controller.L_d[0]=1201",
    "controller.anchor=equilibrium",
    "initial.orientation[0]=0.1",
    "initial.angular_velocity[0]=17",
    "initial.position=[0, 0, 1]",
    "initial.velocity=[0, 0, 1]",
    "initial.connector_state=[0, 0, 1]",
    "integration.duration=2.5",
    "integration.samples=12",
    "integration.coordinates=W",
    "integration.engine=heyoka",
    "integration.method=Radau",
    "integration.rtol=1e-11",
    "integration.atol=1e-11",
    "integration.range_bound=1e-2",
    "integration.step_limit=1000",
    "integration.time_limit=60",
    "reference.source=a paper",
]


def test_every_change_of_a_value_makes_another_run(load):
    names = [run_id(load(EMBEDDED)), *(run_id(load(EMBEDDED, change)) for change in CHANGES)]
    assert len(set(names)) == len(CHANGES) + 1


def test_drift_control_counts_where_there_is_drift(load):
    text = PERMANENT + "  coordinates: manifold\n"
    controls = ["", "drift_control: projection", "drift_control: {baumgarte: 5}"]
    controls.append("drift_control: {baumgarte: 6}")
    assert len({run_id(load(f"{text}  {control}\n")) for control in controls}) == 4


def test_variants_are_different_runs(load):
    assert run_id(load(EMBEDDED)) != run_id(load(VISCO_ELASTIC))


def test_stable_across_processes(write):
    """The hash seed, and with it the order of sets, differs between processes."""
    path = write(EMBEDDED + "reference: {source: a, final: {velocity: [1e-9, 0.1, 1e300]}}\n")
    script = (
        "import sys; from rbstab.config.load import load_config, run_id;"
        "print(run_id(load_config(sys.argv[1])))"
    )
    assert printed_with_hash_seeds(script, path) == {run_id(load_config(path))}


def test_stable_across_versions(load):
    """Stored results are found by this id: it may change with the schema version only."""
    assert run_id(load(VISCO_ELASTIC)) == "99e9d2820487be6b00ab0d546dda4b36"
