"""Protects the proofs of a config: what is proved, what it depends on, and where it is stored."""

import pytest
from support.paper_runs import paper_config

import rbstab
from rbstab.config.build import problem_of
from rbstab.experiment.convergence.convergence import Enclose
from rbstab.experiment.proof import prove
from rbstab.experiment.proof_cache import cached_proof, proof_file, proof_for
from rbstab.experiment.run_certificate import rest_state_check
from rbstab.experiment.run_to_file import finished_run, run_to_file
from rbstab.experiment.stability import stability_of
from rbstab.experiment.stored_proof import identity
from rbstab.experiment.stored_proof.identity import proof_id
from rbstab.experiment.stored_proof.starts import start_level, start_state

SLOW_START = {"angular_velocity": [1.0, 2.0, -1.0]}


def config_of(variant="permanent", with_gravity=False, scale=1.0, **changes):
    gains = {"K_r": [scale * 400.0, scale * 400.0, scale * 320.0]}
    changes.setdefault("controller", {})
    changes["controller"] = {**gains, **changes["controller"]}
    return rbstab.load_config(paper_config(variant, with_gravity, **changes))


@pytest.mark.parametrize(
    ("variant", "level"), [("free", 493), ("permanent", 1020), ("visco-elastic", 918)]
)
def test_the_level_up_to_which_the_paper_s_cases_are_certified(variant, level):
    """Another program found these levels; the paper's initial states are above them."""
    config = config_of(variant)
    proof = prove(config)
    assert proof.proved
    assert proof.unique is True
    assert proof.region is not None
    assert proof.region.level == pytest.approx(level, abs=0.6)
    # The proved level is lower by 1e-7 of it, so that checkers can decide.
    assert (1 - 2e-7) * proof.region.level < proof.region.lower_bound <= proof.region.level
    assert proof.region.face in {"θ2 = -π/2", "θ2 = π/2"}
    start = {"free": 5427.2, "permanent": 8893.5, "visco-elastic": 5427.2}[variant]
    assert start_level(problem_of(config), proof) == pytest.approx(start, abs=0.1)
    assert start_state(problem_of(config), proof) is None


def test_a_search_alone_certifies_nothing():
    config = config_of("free", initial=SLOW_START)
    proof = prove(config, search_only=True)
    assert not proof.proved
    assert proof.unique is None
    assert proof.region is not None
    assert proof.region.lower_bound == 0.0
    assert start_state(problem_of(config), proof) is None
    assert rbstab.simulate(config, proof=proof).attributes["verdict"] == "consistent"


def test_a_proof_depends_on_the_equations(monkeypatch):
    config = config_of("visco-elastic")
    first = proof_id(config)
    monkeypatch.setattr(identity, "_FINGERPRINTS", {})
    assert proof_id(config) == first
    monkeypatch.setattr(identity, "_FINGERPRINTS", {})
    monkeypatch.setattr(identity, "fingerprint", lambda _: "other equations")
    assert proof_id(config) != first


def test_what_a_proof_depends_on():
    """Not the start, nor the integration; what acts on the body."""
    first = proof_id(config_of("visco-elastic"))
    changes = {"initial": SLOW_START, "duration": 1.0, "engine": "heyoka", "rtol": 1e-9}
    assert proof_id(config_of("visco-elastic", **changes)) == first
    others = [
        config_of("visco-elastic", with_gravity=True),
        config_of("visco-elastic", scale=0.5),
        config_of("visco-elastic", controller={"anchor": "equilibrium"}),
        config_of("permanent"),
    ]
    assert len({first, *(proof_id(config) for config in others)}) == 5


def certificate(result):
    return dict(
        zip(
            result["certificate/check"].tolist(),
            result["certificate/verdict"].tolist(),
            strict=True,
        )
    )


def test_verdicts_of_runs():
    short = {"duration": 0.05, "samples": 6}
    inside = config_of("free", initial=SLOW_START, **short)
    proof = prove(inside)
    certified = rbstab.simulate(inside, proof=proof)
    assert words_of(certified) == ("consistent", "proved")
    assert certificate(certified)["certified region"] == "certified"
    without = rbstab.simulate(inside)
    assert words_of(without) == ("consistent", "not decided")
    assert certificate(without)["global stability"] == "unknown"
    # A start can be proved though global stability is false.
    soft = config_of("permanent", scale=0.1, initial=SLOW_START, **short)
    result = rbstab.simulate(soft, proof=prove(soft))
    assert certificate(result)["global stability"] == "violated"
    assert words_of(result) == ("consistent", "proved")
    outside = config_of("free", **short)
    result = rbstab.simulate(outside, proof=proof)
    assert words_of(result) == ("consistent", "not decided")
    assert certificate(result)["global stability"] == "certified"
    assert certificate(result)["certified region"] == "unknown"


def words_of(result):
    """Return the verdict on the computed motion, and what is proved of the exact one."""
    return result.attributes["verdict"], result.attributes["convergence"]


def test_the_verdict_on_an_inaccurate_run_is_not_that_of_the_proof():
    config = config_of("free", initial=SLOW_START, duration=0.5, samples=3, rtol=0.1, atol=1.0)
    proof = prove(config)
    early = rbstab.simulate(rbstab.load_config(config, ["integration.step_limit=2"]), proof=proof)
    assert early.status == "step limit"
    assert words_of(early)[1] == "proved"
    result = rbstab.simulate(config, proof=proof, enclose=Enclose.TO_END)
    assert words_of(result) == ("violated", "proved")
    assert certificate(result)["computed motion"] == "violated"


def test_a_proof_is_read_once_until_its_file_changes(tmp_path):
    config = config_of("free")
    proof_for(tmp_path, config)
    first = cached_proof(tmp_path, config)
    again = cached_proof(tmp_path, config)
    assert first is not None
    assert again is not None
    assert again.states is first.states
    file = proof_file(tmp_path, config)
    content = file.read_text()
    file.write_text(content.replace('"digest"', '"digets"'))
    assert cached_proof(tmp_path, config) is None
    file.write_text(content)
    assert cached_proof(tmp_path, config) == first
    # The proof of something else is not believed.
    other = config_of("permanent")
    file.rename(proof_file(tmp_path, other))
    assert cached_proof(tmp_path, other) is None
    # A folder in its place counts as missing.
    file.mkdir()
    assert cached_proof(tmp_path, config) is None


def test_a_proof_is_added_to_a_finished_run(tmp_path):
    config = config_of("free", initial=SLOW_START, duration=0.05, samples=6)
    path = tmp_path / "a.h5"
    run_to_file(config, path)
    proof = prove(config)
    assert finished_run(config, problem_of(config), path) is not None
    assert finished_run(config, problem_of(config), path, proof=proof) is None
    before = rbstab.open_result(path)
    proved = run_to_file(config, path, proof=proof)
    assert not proved.computed
    assert proved.moved_aside is None
    # The motion is that of before; so is the time at which it was computed.
    after = rbstab.open_result(path)
    assert after.attributes["created"] == before.attributes["created"]
    assert after["orientation"].tobytes() == before["orientation"].tobytes()
    at_once = rbstab.simulate(config, proof=proof)
    assert [*after.attributes] == [*at_once.attributes]
    assert [*after.variables] == [*at_once.variables]
    assert words_of(rbstab.open_result(path)) == ("consistent", "proved")
    assert not run_to_file(config, path, proof=proof).computed
    assert not run_to_file(config, path).computed
    assert words_of(rbstab.open_result(path)) == ("consistent", "proved")


@pytest.mark.parametrize("variant", ["permanent", "embedded"])
def test_each_rest_state_comes_with_its_linearisation(variant):
    config = config_of(variant, with_gravity=True, scale=0.1)
    stability = stability_of(problem_of(config), prove(config))
    for state, linear in zip(stability.proof.states, stability.linearisations, strict=True):
        assert linear is not None
        # There are as many growing modes as negative eigenvalues of the Hessian, at any damping.
        assert linear.growing == state.index


def test_one_rest_state_that_is_no_minimum_is_not_stable():
    proof = prove(config_of("free"))
    (state,) = proof.states
    saddle = proof.model_copy(update={"states": (state.model_copy(update={"index": 1}),)})
    assert proof.globally_stable is True
    assert saddle.globally_stable is False
    open_question = proof.model_copy(update={"unique": None})
    assert open_question.globally_stable is None
    verdicts = [rest_state_check(variant).verdict for variant in (proof, saddle, open_question)]
    assert verdicts == ["certified", "violated", "unknown"]
    stability = stability_of(problem_of(config_of("free")), saddle)
    assert any("not a minimum" in statement for statement in stability.statements)
