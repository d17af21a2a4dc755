"""Protects runs of elements of users: closed forms, elements of ours, and what is not proved."""

import numpy as np
import pytest
from scipy.special import ellipj
from support.switching import data, ligament
from support.user_code import CUBIC, TIE, element_text, mine, write_template

import rbstab
from rbstab.config.elements import kind_of
from rbstab.config.entries import entries_of
from rbstab.config.load import load_config
from rbstab.config.tolerances import tolerances_of
from rbstab.config.units import unit_of
from rbstab.experiment.convergence.convergence import Enclose
from rbstab.experiment.proof import prove
from rbstab.experiment.robust.bodies import CODE_VARIES, prove_within
from rbstab.experiment.stored_proof.identity import proof_id
from rbstab.experiment.stored_proof.proof import SUPPLIES
from rbstab.experiment.tuning.sensitivities import sensitivities
from rbstab.experiment.verification.verify import verify

ENGINES = ("scipy", "heyoka")

FREE = {
    "variant": "free",
    "K_t": [40, 40, 30],
    "L_t": [2, 2, 1],
    "K_r": [4, 4, 3],
    "L_r": [0.6, 0.6, 0.4],
}

VALUES = {
    "point": [0.1, 0.2, -0.1],
    "anchor": [0.0, 0.3, 0.1],
    "K_c": [[30, 2, 0], [2, 20, 1], [0, 1, 10]],
    "L_c": [1, 2, 3],
}

LIGAMENT = element_text(
    """
    mode_count = 2

    def guards(self, motion, own):
        strain = self._strain(motion)
        return np.array([strain, strain - 2.0 * self.toe_strain])

    def wrench(self, motion, own):
        strain, along = self._strain(motion), line(motion, self.point, self.anchor)
        toe = strain * strain / (4.0 * self.toe_strain)
        shape = toe + self.mode[1] * (strain - self.toe_strain - toe)
        tension = self.mode[0] * self.stiffness * shape
        return force_at(motion, self.point, -tension * along.direction)

    def stored(self, motion, own):
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
"""What `kind: ligament` is, without its damper."""

START = {"orientation": [0.1, 0.2, 0.3], "angular_velocity": [1, 2, 3], "velocity": [0.5, -1, 0.2]}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A working folder with the files of the elements."""
    monkeypatch.chdir(tmp_path)
    write_template(tmp_path)
    return tmp_path


def load(elements, engine="scipy", start=None, duration=2.0, **sections):
    integration = {"engine": engine, "duration": duration, "samples": 41, "rtol": 1e-13}
    described = data(elements, start or START, integration, **sections)
    return load_config(described, allow_python=True)


def largest_difference(one, other):
    names = ("orientation", "angular_velocity", "position", "velocity", "lyapunov")
    return max(float(np.abs(one[name] - other[name]).max()) for name in names)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_cubic_spring_in_closed_form(folder, engine):
    """m x'' = -k x³ from rest at x = a: x = a cn(a √(k/m) t) with the parameter 1/2."""
    if engine == "heyoka":
        pytest.importorskip("heyoka")
    position, stiffness = [0.7, -0.5, 0.3], [30.0, 20.0, 10.0]
    start = {"position": position}
    config = load({"mine": CUBIC}, engine, start, duration=5.0)
    result = rbstab.simulate(config)
    assert result.status == "completed"
    for axis, (a, k) in enumerate(zip(position, stiffness, strict=True)):
        frequency = abs(a) * np.sqrt(k / config.body.mass)
        expected = a * ellipj(frequency * result["time"], 0.5)[1]
        np.testing.assert_allclose(result["position"][:, axis], expected, atol=1e-9)
    assert np.abs(result["energy_residual"]).max() < 1e-10 * result["lyapunov"][0]
    stored = sum(k * a**4 / 4 for a, k in zip(position, stiffness, strict=True))
    assert result["energy"][0].sum() == pytest.approx(stored, rel=1e-14)


@pytest.mark.parametrize("engine", ENGINES)
def test_an_element_of_a_user_is_one_of_ours(folder, engine):
    if engine == "heyoka":
        pytest.importorskip("heyoka")
    (folder / "mine.py").write_text(TIE)
    theirs = rbstab.simulate(load({"one": mine(**VALUES)}, engine, controller=FREE))
    ours = rbstab.simulate(
        load({"one": {"kind": "visco-elastic"} | VALUES}, engine, controller=FREE)
    )
    assert largest_difference(theirs, ours) < 1e-12
    np.testing.assert_allclose(theirs["element_force"], ours["element_force"], atol=1e-11)
    np.testing.assert_allclose(theirs["dissipation"], ours["dissipation"], atol=1e-11)
    assert list(theirs["part"]) == list(ours["part"])


@pytest.mark.parametrize("engine", ["scipy", pytest.param("heyoka", marks=pytest.mark.heavy)])
def test_an_element_that_switches(folder, engine):
    if engine == "heyoka":
        pytest.importorskip("heyoka")
    (folder / "mine.py").write_text(LIGAMENT)
    section = ligament()
    parameters = {key: section[key] for key in section if key != "kind"}
    start = {"position": [0.8, 0.1, 0], "velocity": [-0.5, 0.2, 0.1]}
    theirs = rbstab.simulate(load({"one": mine(**parameters)}, engine, start, 10.0))
    ours = rbstab.simulate(load({"one": section}, engine, start, 10.0))
    assert theirs.status == ours.status == "completed"
    assert np.unique(theirs["energy"][:, -1] > 0).tolist() == [False, True]  # slack, and taut
    assert largest_difference(theirs, ours) < 1e-11


def test_sensitivities_are_those_of_ours(folder):
    pytest.importorskip("heyoka")
    (folder / "mine.py").write_text(TIE)
    theirs = sensitivities(load({"one": mine(**VALUES)}, controller=FREE))
    ours = sensitivities(load({"one": {"kind": "visco-elastic"} | VALUES}, controller=FREE))
    keys = {entry.key.replace(".parameters", ""): row for row, entry in enumerate(theirs.entries)}
    rows = [keys[entry.key] for entry in ours.entries]
    assert len(rows) == len(theirs.entries)
    np.testing.assert_allclose(theirs.derivatives[rows], ours.derivatives, rtol=1e-6, atol=1e-9)


def test_sensitivities_of_an_element_that_switches(folder):
    pytest.importorskip("heyoka")
    (folder / "mine.py").write_text(LIGAMENT)
    section = ligament()
    parameters = {key: value for key, value in section.items() if key != "kind"}
    start = {"position": [0.8, 0.1, 0], "velocity": [-0.5, 0.2, 0.1]}
    given = {"start": start, "duration": 3.0, "controller": FREE}
    theirs = sensitivities(load({"one": mine(**parameters)}, **given))
    ours = sensitivities(load({"one": section}, **given))
    keys = {entry.key.replace(".parameters", ""): row for row, entry in enumerate(theirs.entries)}
    # Theirs has no damper.
    mine_too = [row for row, entry in enumerate(ours.entries) if entry.key in keys]
    assert len(mine_too) == len(theirs.entries) == len(ours.entries) - 1
    rows = [keys[ours.entries[row].key] for row in mine_too]
    expected = ours.derivatives[mine_too]
    np.testing.assert_allclose(theirs.derivatives[rows], expected, rtol=1e-8, atol=1e-9)


def test_proofs_for_all_bodies_are_those_of_the_same_element_of_ours(folder):
    (folder / "mine.py").write_text(TIE)
    config = load({"one": mine(**VALUES)}, controller=FREE)
    ours = load({"one": {"kind": "visco-elastic"} | VALUES}, controller=FREE)
    texts = ["controller.K_t=±1%", "controller.K_r=±1%"]
    within, known = (prove_within(one, tolerances_of(one, texts)) for one in (config, ours))
    assert within.proved
    assert within.level == pytest.approx(known.level, rel=1e-9)
    for text in ("body.contact_point=±0.01", "elements.one=±1%"):
        varied = prove_within(config, tolerances_of(config, [text]))
        assert (varied.proved, varied.why) == (None, CODE_VARIES)


def test_a_proof_is_not_that_of_another_element(folder):
    (folder / "mine.py").write_text(TIE)
    stiffer = VALUES | {"K_c": [31, 20, 10]}
    config = load({"one": mine(**stiffer)}, controller=FREE)
    ours = prove(load({"one": {"kind": "visco-elastic"} | VALUES}, controller=FREE))
    assert ours.proved
    (refused,) = [
        f for f in verify(ours, config).findings if f.claim == "energy" and not f.verified
    ]
    assert "is not that of the config" in refused.text


def test_the_identity_of_a_proof_needs_no_code(folder):
    from rbstab.config.load import config_to_read, plain_data

    (folder / "mine.py").write_text(TIE)
    config = load({"one": mine(**VALUES)}, controller=FREE)
    read = config_to_read(plain_data(config))
    assert proof_id(read) == proof_id(config)
    (folder / "mine.py").write_text(TIE + "# another text\n")
    assert proof_id(load({"one": mine(**VALUES)}, controller=FREE)) != proof_id(config)


OTHERS = {
    "creep": {
        "kind": "embedded",
        "point": [0.1, 0.0, 0.2],
        "anchor": [0.1, 0.0, 0.2],
        "K_c": [40, 40, 40],
        "L_c": [2, 2, 2],
        "K_d": [20, 20, 20],
        "L_d": [3, 3, 3],
        "initial_state": [0.01, 0.0, -0.02],
    },
    "grip": {
        "kind": "sliding",
        "point": [0.0, 0.1, 0.0],
        "anchor": [0.0, 0.1, 0.0],
        "K_s": [1, 1, 1],
        "surface": {"slope": 2.0},
    },
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
"""An element of each kind that has something of its own: states, modes, a supply, impacts."""

MINE = mine(**VALUES) | {"file": "tie.py"}


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize("beside", [("creep", "grip"), ("creep", "knock"), ("creep", "end")])
def test_beside_the_other_kinds(beside, tmp_path):
    """An element of a user acts beside each other kind as the same element of the program does."""
    (tmp_path / "tie.py").write_text(TIE)
    others = {name: OTHERS[name] for name in beside}
    ours = {"tie": {"kind": "visco-elastic", **VALUES}}
    results = [
        rbstab.simulate(load(others | tie, controller=FREE)) for tie in (ours, {"tie": MINE})
    ]
    assert [result.status for result in results] == ["completed"] * 2
    assert largest_difference(*results) < 1e-9
    np.testing.assert_allclose(results[0]["creep.state"], results[1]["creep.state"], atol=1e-9)
    assert results[1].attributes["verdict"] == results[0].attributes["verdict"]


@pytest.mark.usefixtures("folder")
def test_keys_beside_the_other_kinds(tmp_path):
    """Entries, units and columns of all kinds in one config."""
    (tmp_path / "tie.py").write_text(TIE)
    config = load({"tie": MINE, **{name: OTHERS[name] for name in ("creep", "knock")}})
    keys = {entry.key for entry in entries_of(config)}
    units = {
        "elements.tie.parameters.K_c[0][1]": "N/m",
        "elements.creep.initial_state[2]": "m",
        "elements.knock.signal.start": "s",
        "elements.knock.amplitude": "N",
    }
    assert units.keys() <= keys
    kinds = {name: kind_of(section) for name, section in config.elements.items()}
    for key, unit in units.items():
        assert unit_of(key.partition("[")[0], {kinds[key.split(".")[1]]}) == unit


@pytest.mark.usefixtures("folder")
def test_an_input_beside_code_decides_nothing(tmp_path):
    (tmp_path / "tie.py").write_text(TIE)
    config = load({"tie": MINE, "knock": OTHERS["knock"]}, controller=FREE)
    assert prove(config).outcome == SUPPLIES
    within = prove_within(config, tolerances_of(config, ["body.mass=±1%"]))
    assert (within.proved, within.why) == (None, SUPPLIES)
    found = rbstab.simulate(config, proof=prove(config), enclose=Enclose.TO_END)
    assert found.attributes["convergence"] == "not decided"
    assert "an input supplies power" in str(found.attributes["convergence_reason"])
