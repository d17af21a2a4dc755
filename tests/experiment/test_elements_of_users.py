"""Protects runs, sweeps and derivatives of elements of users: those of ours, and closed forms.

`creeping_tie.py` states what the embedded tie of the program states, `TIE` what a visco-elastic one
does, `LIGAMENT` what a ligament does without its damper.
"""

import json
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.special import ellipj
from support.switching import data, ligament
from support.user_code import (
    CREEPING_TIE,
    CUBIC,
    MAXWELL,
    TIE,
    element_text,
    python_section,
    write_template,
)

import rbstab
from rbstab.config.load import (
    config_to_read,
    load_config,
)
from rbstab.config.tolerances import tolerances_of
from rbstab.experiment.robust.bodies import CODE_VARIES, prove_within
from rbstab.experiment.stored_proof.identity import proof_id
from rbstab.experiment.stored_run import own_states_of
from rbstab.report.reading.sources import read_sources
from rbstab.store.result import write_result
from rbstab_cli.main import cli

LIGAMENT = element_text(
    """
    mode_count = 2

    def guards(self, motion, states):
        strain = self._strain(motion)
        return np.array([strain, strain - 2.0 * self.toe_strain])

    def wrench(self, motion, states):
        strain, along = self._strain(motion), line(motion, self.point, self.anchor)
        toe = strain * strain / (4.0 * self.toe_strain)
        shape = toe + self.mode[1] * (strain - self.toe_strain - toe)
        tension = self.mode[0] * self.stiffness * shape
        return force_at(motion, self.point, -tension * along.direction)

    def stored(self, motion, states):
        strain, end = self._strain(motion), self.toe_strain
        toe = strain * strain * strain / (12.0 * end)
        linear = 0.5 * (strain - end) * (strain - end) + end * end / 6.0
        both = toe + self.mode[1] * (linear - toe)
        return self.mode[0] * self.slack_length * self.stiffness * both

    def _strain(self, motion):
        return line(motion, self.point, self.anchor).length / self.slack_length - 1.0
    """,
    'POINT, ANCHOR, Gain("stiffness", "N", "k", shape="number"), '
    'Gain("slack_length", "m", "l", shape="number"), '
    'Gain("toe_strain", "1", "e", shape="number")',
)

Values = dict[str, Any]
FREE: Values = {"variant": "free", "K_t": [40, 40, 30], "L_t": [2, 2, 1]}
FREE |= {"K_r": [4, 4, 3], "L_r": [0.6, 0.6, 0.4]}
TIED: Values = {"point": [0.1, 0.2, -0.1], "anchor": [0.0, 0.3, 0.1], "L_c": [1, 2, 3]}
TIED |= {"K_c": [[30, 2, 0], [2, 20, 1], [0, 1, 10]]}
CREEP = TIED | {"K_d": [9, 8, 7], "L_d": [3, 2, 1], "initial_state": [0.02, -0.03, 0.01]}
CORD = {key: value for key, value in ligament().items() if key != "kind"}
OTHERS: dict[str, Values] = {
    "grip": {"kind": "sliding", "K_s": [1, 1, 1], "surface": {"slope": 2.0}}
    | {"point": [0.0, 0.1, 0.0], "anchor": [0.0, 0.1, 0.0]},
    "knock": {
        "kind": "input",
        "quantity": "force",
        "point": [0.0, 0.0, 0.1],
        "direction": [1, 0, 0],
        "amplitude": 2.0,
        "signal": {"kind": "pulse", "start": 0.5, "duration": 0.3},
    },
    "end": {"kind": "guard", "method": "stop", "angle": 1.0, "restitution": 0.5},
}
"""An element of each kind that has something of its own: modes, a supply, impacts."""


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """A working folder with the files of the elements."""
    monkeypatch.chdir(tmp_path)
    write_template(tmp_path)
    texts = {"tie": TIE, "cord": LIGAMENT, "maxwell": MAXWELL}
    texts["creep"] = CREEPING_TIE.read_text(encoding="utf-8").replace("CreepingTie", "Mine")
    for name, text in texts.items():
        (tmp_path / f"{name}.py").write_text(text, encoding="utf-8")
    return tmp_path


def code(name, **values):
    return python_section(**values) | {"file": f"{name}.py"}


def load(elements, engine="scipy", duration=1.0, start=None, **sections):
    turning = {"orientation": [0.1, 0.2, 0.3], "angular_velocity": [1, 2, 3]}
    integration = {"engine": engine, "duration": duration, "samples": 41, "rtol": 1e-13}
    start = start or turning | {"velocity": [0.5, -1, 0.2]}
    sections = {"controller": FREE} | sections
    sections = {name: section for name, section in sections.items() if section is not None}
    given = data(elements, start, integration, **sections)
    return load_config(given, allow_python=True)


BUILT_IN = {
    "tie": {"kind": "visco-elastic"} | TIED,
    "creep": {"kind": "embedded"} | CREEP,
    "cord": {"kind": "ligament", "damping": 0.0} | CORD,
}
THEIRS = {"tie": code("tie", **TIED), "creep": code("creep", **CREEP), "cord": code("cord", **CORD)}
FALLS: Values = {"position": [0.8, 0.1, 0], "velocity": [-0.5, 0.2, 0.1]}

HEYOKA = pytest.param("heyoka", marks=pytest.mark.slow)


@pytest.mark.parametrize("engine", ["scipy", HEYOKA])
@pytest.mark.parametrize(
    ("name", "beside", "start"),
    [
        ("tie", "", None),
        ("creep", "", None),
        ("cord", "", FALLS),
        *(("creep", beside, None) for beside in OTHERS),
    ],
)
def test_the_motion_is_that_of_our_element(name, beside, start, engine):
    if engine == "heyoka" and beside:
        return
    others = {beside: OTHERS[beside]} if beside else {}
    duration = 10.0 if name == "cord" else 1.0
    theirs, built_in = (
        rbstab.simulate(load(others | {"one": of[name]}, engine, duration, start))
        for of in (THEIRS, BUILT_IN)
    )
    assert theirs.status == built_in.status == "completed"
    bound = 1e-10 if beside or name == "cord" else 1e-12  # their events have errors
    names = ["orientation", "angular_velocity", "position", "velocity", "lyapunov"]
    for quantity in [*names, "energy", "element_force", "dissipation"]:
        size = max(1.0, np.abs(built_in[quantity]).max())
        assert np.abs(theirs[quantity] - built_in[quantity]).max() < bound * size, quantity
    assert list(theirs["part"]) == list(built_in["part"])
    assert theirs.attributes["verdict"] == built_in.attributes["verdict"]
    if name == "creep":
        np.testing.assert_allclose(theirs["one.state"], built_in["one.state"], rtol=0, atol=1e-11)
        np.testing.assert_array_equal(theirs["one.state"][0], CREEP["initial_state"])
        variable, other = theirs.variables["one.state"], built_in.variables["one.state"]
        assert (variable.unit, variable.dimensions) == (other.unit, other.dimensions)
        assert variable.long_name == "D: the point between the springs, inertial"
    if name == "cord":  # slack, and taut
        assert np.unique(theirs["energy"][:, -1] > 0).tolist() == [False, True]


@pytest.mark.parametrize("engine", ["scipy", HEYOKA])
def test_a_cubic_spring_in_closed_form(engine):
    """m x'' = -k x³ from rest at x = a: x = a cn(a √(k/m) t) with the parameter 1/2."""
    position, stiffness = [0.7, -0.5, 0.3], [30.0, 20.0, 10.0]
    config = load({"mine": CUBIC}, engine, 5.0, {"position": position}, controller=None)
    result = rbstab.simulate(config)
    for axis, (a, k) in enumerate(zip(position, stiffness, strict=True)):
        frequency = abs(a) * np.sqrt(k / config.body.mass)
        expected = a * ellipj(frequency * result["time"], 0.5)[1]
        np.testing.assert_allclose(result["position"][:, axis], expected, atol=1e-9)
    assert np.abs(result["energy_residual"]).max() < 1e-10 * result["lyapunov"][0]
    stored = sum(k * a**4 / 4 for a, k in zip(position, stiffness, strict=True))
    assert result["energy"][0].sum() == pytest.approx(stored, rel=1e-14)


def test_a_state_of_another_size_relaxes_is_stored_and_shown(folder):
    """A spring and a damper in a row between fixed points: s falls as exp(-k t/c)."""
    far = {"point": [0, 0, 0], "anchor": [1.0, 0, 0], "k": 8.0, "c": 2.0}
    heavy = {"mass": 1e12, "inertia": [1e12] * 3, "contact_point": [0, 0, 0]}
    element = code("maxwell", **far, initial_extension=[0.3])
    start = {"position": [0, 0, 0]}
    config = load({"one": element}, start=start, body=heavy, gravity=[0, 0, 0], controller=None)
    result = rbstab.simulate(config)
    expected = 0.3 * np.exp(-4.0 * result["time"])
    np.testing.assert_allclose(result["one.extension"][:, 0], expected, rtol=1e-10)
    assert result.variables["one.extension"].dimensions == ("time", "one.extension_component")
    # Its file also has an array with the numbers of its entries, which is no state.
    assert own_states_of(result) == ("one.extension",)
    write_result(folder / "run.h5", result)
    sources = read_sources([folder / "run.h5"])
    assert own_states_of(sources.runs[0].result) == ("one.extension",)
    shown = CliRunner().invoke(cli, ["show", "--json", "run.h5"])
    assert len(json.loads(shown.stdout)["final"]["one.extension"]) == 1
    assert "final one.extension" in CliRunner().invoke(cli, ["show", "run.h5"]).stdout


def test_proofs_for_all_bodies_are_those_of_the_same_element_of_ours():
    config, built_in = (load({"one": of["tie"]}) for of in (THEIRS, BUILT_IN))
    texts = ["controller.K_t=±1%", "controller.K_r=±1%"]
    within, expected = (
        prove_within(body, tolerances_of(body, texts)) for body in (config, built_in)
    )
    assert within.proved
    assert within.level == pytest.approx(expected.level, rel=1e-9)
    for text in ("body.contact_point=±0.01", "elements.one=±1%"):
        varied = prove_within(config, tolerances_of(config, [text]))
        assert (varied.proved, varied.why) == (None, CODE_VARIES)


def test_the_identity_of_a_proof_needs_no_code(folder):
    config = load({"one": THEIRS["tie"]})
    assert proof_id(config_to_read(config.plain())) == proof_id(config)
    (folder / "tie.py").write_text(TIE + "# another text\n")
    assert proof_id(load({"one": THEIRS["tie"]})) != proof_id(config)
