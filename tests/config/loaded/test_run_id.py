"""Two configs have the same run id exactly when physics and settings are the same."""

import json

import pytest
from support.config_elements import config_data
from support.configs import EMBEDDED, MANIFOLD, PERMANENT, VISCO_ELASTIC, edited, plain
from support.fresh_process import printed_with_hash_seeds
from support.inputs import SIGNALS, driven, force

from rbstab.config.load import load_config, run_id

HEYOKA = VISCO_ELASTIC + "  engine: heyoka\n"

WITH_ELEMENTS = json.dumps(config_data())


def turned(data):
    """Return plain data with the keys of each mapping in the opposite order."""
    if not isinstance(data, dict):
        return data
    return {key: turned(data[key]) for key in reversed(data)}


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
    (VISCO_ELASTIC, edited("initial:", "initial:\n  attached: false")),
    # A gain that is left out is zero.
    *(
        (edited(line, f"{line[:5]}: 0\n"), edited(line, ""))
        for line in VISCO_ELASTIC.splitlines(keepends=True)[7:11]
    ),
    # The order of keys and of elements.
    (VISCO_ELASTIC, json.dumps(turned(plain()))),
    (WITH_ELEMENTS, json.dumps(turned(config_data()))),
    # What is wanted of a motion does not change it.
    (VISCO_ELASTIC, VISCO_ELASTIC + "desired:\n  orientation: [0, 0.5, 0]\n  within: 0.2\n"),
    (VISCO_ELASTIC, VISCO_ELASTIC + "bound: {couple: 20, tilt: {deg: 30}}\n"),
    # Keys without effect.
    (HEYOKA, HEYOKA + "  method: Radau\n"),
    (HEYOKA, HEYOKA + "  atol: 1e-6\n"),
    (PERMANENT, PERMANENT + "  drift_control: none\n"),
    (PERMANENT, edited("initial:", "initial:\n  attached: true", PERMANENT)),
]


@pytest.mark.parametrize(("text", "other"), SAME)
def test_what_is_written_in_another_way_is_the_same_run(load, text, other):
    assert text != other
    assert run_id(load(text)) == run_id(load(other))


def test_a_seed_may_be_a_whole_float():
    """A plan varies floats; the run is that of the whole number."""
    noise = SIGNALS["noise"]
    ids = [run_id(load_config(driven({"a": force(noise | {"seed": s})}))) for s in (4, 4.0, 5)]
    assert ids[0] == ids[1] != ids[2]


CHANGES = {
    EMBEDDED: [
        "title=Other",
        "body.mass=41.000000000000007",  # the next float
        "body.inertia[2]=0.5",
        "body.inertia=[[10, 0, 0], [0, 8, 0], [0, 0, 0.4]]",
        "body.contact_point[1]=0.11",
        "gravity=[0, 0, -9.81]",
        *(f"controller.{gain}_{at}[0]=7" for gain in "KL" for at in "trcd"),
        "controller.anchor=equilibrium",
        "initial.orientation[0]=0.1",
        "initial.attached=true",
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
    ],
    MANIFOLD: [
        "integration.drift_control=projection",
        "integration.drift_control={baumgarte: 5}",
        "integration.drift_control={baumgarte: 6}",
        "integration.coordinates=reduced",
    ],
    WITH_ELEMENTS: [
        "elements.strut.point[0]=0.021",
        "elements.strut.anchor[2]=1.41",
        "elements.strut.stiffness=901",
        "elements.strut.rest_length=0.81",
        "elements.strut.damping=0",
        "elements.tie.K_c[2][2]=2001",
        "elements.tie.L_c[1]=31",
        "elements.upright.K[0]=401",
        "elements.upright.L[0]=21",
        "elements.range.stiffness=11",
        "elements.range.outer_stiffness=0",
        "elements.more={kind: attitude, K: [1, 1, 1], L: [1, 1, 1]}",
        "elements={}",
    ],
    WITH_ELEMENTS.replace("strut", "brace"): [],
    VISCO_ELASTIC: [],
}


def test_every_change_of_a_value_makes_another_run(load):
    ids = [run_id(load(text, *change)) for text in CHANGES for change in [(), *zip(CHANGES[text])]]
    assert len(ids) == len(set(ids)) == len(CHANGES) + sum(map(len, CHANGES.values()))


def test_the_id_is_the_same_in_every_process(write):
    """The hash seed, and with it the order of sets, differs between processes."""
    path = write(WITH_ELEMENTS[:-1] + ', "reference": {"source": "a"}}')
    script = (
        "import sys; from rbstab.config.load import load_config, run_id;"
        "print(run_id(load_config(sys.argv[1])))"
    )
    assert printed_with_hash_seeds(script, path) == {run_id(load_config(path))}


def test_the_id_is_the_same_in_every_version(load):
    """Stored results are found by this id: it may change with the schema version only."""
    assert run_id(load(VISCO_ELASTIC)) == "99e9d2820487be6b00ab0d546dda4b36"
