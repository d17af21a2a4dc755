"""What is proved of starts: its file, its identity and its sentence."""

from support.configs import BY_VARIANT, plain

from rbstab.config.load import load_config
from rbstab.config.tolerances import tolerances_of
from rbstab.experiment import proof_cache
from rbstab.experiment.robust import record as robust_record
from rbstab.experiment.robust.record import bounds_of
from rbstab.experiment.start_sets import prove_starts, starts_record
from rbstab.experiment.start_sets.prove_starts import starts_for
from rbstab.experiment.start_sets.starts_record import (
    ProvedPart,
    StartsProof,
    starts_id,
)
from rbstab.store.errors import StoreError

TEXT = "initial.angular_velocity=±0.1"


def part(**changes):
    given = {
        "low": (-1.0, 0.0),
        "high": (1.0, 1.0),
        "rest_state": 1,
        "time": 0.12341,
        "energy": (1.0, 2.0),
        "bound": 3.0,
        "steps": 12,
    }
    return ProvedPart(**given | changes)


def proof(*parts, fraction=1.0, why=""):
    config = load_config(plain())
    tolerances = tolerances_of(config, [TEXT])
    return StartsProof(
        id=starts_id(config, tolerances),
        version=1,
        tolerances=bounds_of(tolerances),
        parts=parts,
        fraction=fraction,
        examined=3,
        steps=20,
        why=why,
        seconds=1.25,
    )


def test_what_is_proved_is_stored_and_found_again(tmp_path, monkeypatch):
    """One proof serves all later calls; those of other tolerances are not mixed up."""
    config, asked = load_config(plain()), []

    def prove(given, tolerances, rest_states, **options):
        asked.append(tolerances)
        identity = starts_id(given, tolerances)
        return proof(part()).model_copy(update={"id": identity, "steps": len(asked)})

    monkeypatch.setattr(prove_starts, "prove_starts", prove)
    monkeypatch.setattr(prove_starts, "proof_for", lambda *_: None)
    original, other = (tolerances_of(config, [text]) for text in (TEXT, "initial.orientation=±0.1"))
    first = starts_for(tmp_path, config, original)
    assert first[1] is None
    assert starts_for(tmp_path, config, original) == first
    assert starts_for(tmp_path, config, other)[0].steps == len(asked) == 2


def test_a_proof_that_cannot_be_stored_is_returned_with_the_error(tmp_path, monkeypatch):
    def fails(*_):
        raise StoreError("disk") from OSError(5, "input/output error")

    monkeypatch.setattr(prove_starts, "prove_starts", lambda *_, **__: proof(part()))
    for name in ("prove", "proof_for"):
        monkeypatch.setattr(prove_starts, name, lambda *_: None)
    config = load_config(plain())
    for room, broken in ((robust_record, "write_document"), (proof_cache, "read_model")):
        with monkeypatch.context() as patch:
            patch.setattr(room, broken, fails)
            returned, problem = starts_for(tmp_path, config, tolerances_of(config, [TEXT]))
        assert returned == proof(part())
        assert isinstance(problem, StoreError)
        assert not (tmp_path / "proofs").exists()


def identity(text=TEXT, **changes):
    data = plain(BY_VARIANT["visco-elastic"])
    config = load_config({**data, **changes})
    return starts_id(config, tolerances_of(config, [text]))


def test_the_identity_is_that_of_the_problem():
    given = identity()
    assert given == identity()
    # Neither the title nor the samples are in it.
    assert given == identity(title="Other")
    assert given == identity(integration={"duration": 3.0, "samples": 5})
    data = plain()
    others = [
        identity("initial.angular_velocity=±0.2"),
        identity("initial.orientation=±0.1"),
        identity(initial=data["initial"] | {"orientation": [0, 0.1, 0]}),
        identity(body=data["body"] | {"mass": 42.0}),
    ]
    assert len({given, *others}) == len(others) + 1


def test_other_equations_or_another_method_have_another_identity(monkeypatch):
    given = identity()
    for name, other in (("VERSION", 2), ("MAX_PARTS", 32), ("equations_of", lambda _: "other")):
        with monkeypatch.context() as patch:
            patch.setattr(starts_record, name, other)
            assert identity() != given


def test_the_sentence_of_a_whole_proof():
    whole = proof(part(), part(low=(-1.0, -1.0), high=(1.0, 0.0), time=0.1, energy=(0.5, 1.5)))
    assert whole.proved is True
    assert whole.rest_states == (1,)
    assert whole.sentence == (
        "the motion converges to rest state 1, proved; inside the certified region from "
        "t = 0.1235 s at the latest (v at most 2 J < 3 J), 2 parts, 20 steps, 1.2 s"
    )
    at_once = proof(part(time=0.0))
    assert "; inside the certified region from the start (v" in at_once.sentence
    assert "1 part, 20" in at_once.sentence


def test_a_sentence_about_two_regions_compares_no_energy_of_one_with_the_level_of_the_other():
    both = proof(part(energy=(1.0, 2.0)), part(rest_state=2, energy=(-9.0, -8.0), bound=-7.0))
    assert both.rest_states == (1, 2)
    assert "to rest state 1 or 2, proved" in both.sentence
    assert "(v at most 2 J)" in both.sentence
    assert "; inside the regions of rest state 1 or 2 from t = 0.1235 s at" in both.sentence
    assert "inside the region of rest state 2 from" in proof(part(rest_state=2)).sentence


def test_the_sentence_of_a_part_never_claims_the_whole():
    almost = proof(part(), fraction=1 - 2**-53, why="more than 2 parts would be needed")
    assert almost.proved is None
    assert almost.sentence == (
        "convergence is not decided; proved for 99.99 % of them; more than 2 parts would be needed"
    )
    third = proof(part(), fraction=1 / 3, why="x")
    assert "proved for 33.33 % of them" in third.sentence
    nothing = proof(fraction=0.0, why="no region")
    assert nothing.sentence == "convergence is not decided; no region"
    assert nothing.time == 0.0
