"""`rbstab stability`: proofs, verdicts, curves along a gain, and bodies that cannot rest."""

import json
import re
from pathlib import Path

import pytest
import yaml
from cli.conftest import json_of, rbstab, success
from support.leg import held_leg, leg

from rbstab import open_result

WEAK = "controller.K_r=[40,40,32]"


def test_what_is_said_of_a_good_config(folder):
    done = success("stability", "good.yaml")
    text = done.stdout
    assert text.startswith("good.yaml: A short run\n")
    assert "1 rest state in the range: 1 stable; proved to be all" in text
    assert "Globally stable: proved. Every motion that stays in the range, and keeps a " in text
    assert ", inside; convergence is proved" in text
    assert "Checks of the computed run: seen." in text
    for word in ("stable", "ζ", "derivative", "certified region"):
        assert word in text
    assert len(list((folder / "results" / "proofs").iterdir())) == 1


def test_json_has_all_of_it(folder):
    done = rbstab("stability", "good.yaml", "--json", "--along", "controller.K_r=x0.5:x2:3")
    (facts,) = json.loads(done.stdout)
    assert facts["proved"] is True
    assert facts["unique"] is True
    assert facts["inside"] is True
    (state,) = facts["states"]
    assert state["index"] == 0
    assert state["orientation"] == pytest.approx([0, 0, 0], abs=1e-9)
    # The least damped mode of the free body: m ẍ + L ẋ + K x = 0 along the third axis.
    frequencies = [mode["natural_frequency"] for mode in state["modes"]]
    assert any(f == pytest.approx((3280 / 41) ** 0.5) for f in frequencies)
    assert facts["certificate"]["verdict"] == "consistent"
    assert [line["check"] for line in facts["certificate"]["lines"]][-1] == "certified region"
    (along,) = facts["along"]
    assert [point["factor"] for point in along["points"]] == pytest.approx([0.5, 1, 2])
    assert len(along["points"][0]["eigenvalues"]) == 12


def test_a_counterexample_is_named(folder):
    text = Path("good.yaml").read_text().replace("variant: free", "variant: permanent")
    text = text.replace("initial:", "initial: # spin\n ").replace("# spin\n  {", "{")
    Path("held.yaml").write_text(text.replace("inertia: [10.0, 9.0, 2.0]", "inertia: [10, 8, 3]"))
    done = success("stability", "held.yaml", "--set", WEAK, "--no-run")
    assert "3 rest states in the range: 1 stable, 2 unstable; proved to be all" in done.stdout
    assert "Almost every start: proved. Returns: almost every start" in done.stdout
    other = "the unstable rest state 2, Θ = (-1.33, 1.514, -2.447) rad"
    assert f"not every start; the body can also rest at {other}" in done.stdout
    assert "unstable, index 2" in done.stdout
    assert "Verdict" not in done.stdout


def test_run_prove_makes_the_proof(folder):
    first = rbstab("run", "--no-prove", "good.yaml", "--json")
    assert json.loads(first.stdout)[0]["convergence"]["proved"] is None
    second = rbstab("run", "good.yaml", "--json", "--prove")
    facts = json.loads(second.stdout)[0]
    assert (facts["convergence"]["proved"], facts["computed"]) == (True, False)
    # It is used by every command, and made once.
    (kept,) = (folder / "results" / "proofs").iterdir()
    before = kept.stat().st_mtime_ns
    without = rbstab("run", "--no-prove", "good.yaml", "--json", "-o", "results", "--force")
    assert json.loads(without.stdout)[0]["convergence"]["proved"] is True
    search = ("stability", "good.yaml", "--search-only", "--no-run")
    done = rbstab(*search)
    assert "proved to be all" in done.stdout
    assert kept.stat().st_mtime_ns == before
    assert rbstab(*search, "-o", "stability.txt").stdout == ""
    assert Path("stability.txt").read_text() == done.stdout
    searched = rbstab(*search, "--results", "other").stdout
    assert "not proved to be all" in searched
    assert "from a search, not proved" in searched
    assert not Path("other").exists()


def test_a_folder_that_takes_no_proof_is_no_error(folder):
    Path("results").mkdir()
    Path("results/proofs").write_text("a file")
    done = success("stability", "good.yaml", "--no-run")
    assert "the proof is not stored" in done.stderr
    assert "proved to be all" in done.stdout


def test_the_run_of_a_violated_argument_is_told(folder):
    """Implicit steps this long violate the energy balance of v."""
    text = Path("good.yaml").read_text().replace("variant: free", "variant: sliding")
    law = "K_s: [20000, 20000, 20000]\n  surface: position\n  law: {implicit: 0.01}\n  K_t"
    text = text.replace("K_t", law).replace("[1, 2, -1]", "[16, 32, -16]")
    Path("coarse.yaml").write_text(text)
    done = rbstab("run", "--no-prove", "coarse.yaml")
    assert "the Lyapunov argument fails: audit: max |r| / largest energy: " in done.stderr
    assert " > 0.01\n" in done.stderr
    assert "This start:  not decided: the check audit of the computed run failed" in done.stdout


CONFIGS = Path(__file__).parents[2] / "configs"

LAW = "K_s: [20000, 20000, 20000]\n  surface: {slope: 20}\n  law: exact\n  K_t"
SHORT = ("--no-run", "--search-only")


def test_a_gain_without_an_effect_has_one_row(folder):
    text = Path("good.yaml").read_text().replace("variant: free", "variant: sliding")
    Path("sliding.yaml").write_text(text.replace("K_t", LAW, 1))
    done = success("stability", "sliding.yaml", *SHORT, "--along", "controller.K_s=x0.5:x2:5")
    assert "controller.K_s does not change the linearised system." in done.stdout
    table = done.stdout.partition("Along controller.K_s")[2].partition("Not listed")[0]
    *rows, why = [line for line in table.splitlines() if line.strip()]
    assert len(rows) == 4
    assert "not decided: the connector's force on the surface s = F + κE has no potential" in why
    assert "E decays as exp(-κt), κ = 20 1/s" in done.stdout


def test_round_off_is_not_printed_as_an_oscillation():
    """A damper gives two axes of this body the same two real eigenvalues."""
    config = str(CONFIGS / "examples" / "real_body.yaml")
    done = success("stability", config, *SHORT, "--along", "controller.K_r=x0.5:x2:3")
    assert "-24.42" in done.stdout
    assert " ± " in done.stdout.partition("Along")[2]
    assert not re.search(r"e-\d+i", done.stdout)


def test_the_gain_from_which_on_a_leg_stands_is_named(tmp_path):
    """Upright is stable for K_r > m g l = 6.386 N m/rad."""
    config = tmp_path / "leg.yaml"
    config.write_text(yaml.safe_dump(leg()))
    along = ("--along", "controller.K_r=x0.6:x0.7:3")
    done = success("stability", str(config), *SHORT, *along)
    text = " ".join(done.stdout.split())
    assert "K_r[0] [N m/rad]" in text
    values = [10 * 0.6 * (0.7 / 0.6) ** (k / 2) for k in range(3)]
    assert all(f" {value:.4g} " in text for value in values)
    sentence = (
        "The body at rest at its desired attitude, upright (default), within 10°, is stable for "
        "K_r[0] ≥ 6.481 N m/rad; unstable there for ≤ 6.000 (by the eigenvalues)."
    )
    assert sentence in text
    (facts,) = json_of("stability", str(config), *SHORT, *along)
    (locus,) = facts["along"]
    assert locus["number"] == "K_r[0]"
    assert [point["value"] for point in locus["points"]] == pytest.approx(values)
    assert f"{locus['stable'][:1].upper()}{locus['stable'][1:]}." == sentence


def test_short_ranges_keep_their_ends_apart_and_one_value_is_called_so(tmp_path):
    config = tmp_path / "leg.yaml"
    config.write_text(yaml.safe_dump(held_leg((10, 10, 5))))
    short = ("--no-run", "--results", str(tmp_path / "results"), "--along")
    done = success("stability", str(config), *short, "controller.K_r[0]=10:10.000001:2")
    assert "10 to 10.000001 " in done.stdout
    done = success("stability", str(config), *short, "controller.K_r[0]=10:10:2")
    assert "not decided: there is one value alone" in done.stdout
    assert "does not change" not in done.stdout


def test_rest_states_are_counted_along_a_number(tmp_path):
    """K θ = m g l sin θ: three rest states below K = m g l = 6.38631, and one above."""
    config, figure = tmp_path / "leg.yaml", tmp_path / "branches.csv"
    config.write_text(yaml.safe_dump(held_leg((10, 10, 5))))
    results = ("--no-run", "--results", str(tmp_path / "results"))
    along = (*results, "--along", "controller.K_r[0]=5:8.1:3")
    done = success("stability", str(config), *along, "--figure", str(figure))
    assert "Pitchfork at K_r[0] = 6.38631, Θ = (0, 0, 0) rad (computed, not proved)" in done.stdout
    proved = re.findall(r"(\S+) to (\S+) +(\d) +(\d) +proved for each value", done.stdout)
    (low, end, *below), (start, high, *above) = proved
    assert (low, below, above, high) == ("5", ["3", "2"], ["1", "1"], "8.1")
    assert 6.3 < float(end) < 6.38631 < float(start) < 6.45
    points = [line.split(",") for line in figure.read_text().splitlines()]
    (turn,) = [row for row in points if row[3] == "pitchfork"]
    assert float(turn[4]) == pytest.approx(6.38631, abs=1e-5)
    assert {row[3] for row in points[1:]} == {"stable", "unstable", "pitchfork"}
    locus = json_of("stability", str(config), *along, "--search-only")[0]["along"][0]
    assert {entry["proved"] for entry in locus["intervals"]} == {False}
    assert [entry["states"] for entry in locus["intervals"]] == [3, 1]
    assert [entry["kind"] for entry in locus["turns"]] == ["pitchfork"]
    assert locus["branches"]


def test_a_rest_state_that_leans_too_far_is_not_the_desired_one(tmp_path):
    config = tmp_path / "leg.yaml"
    config.write_text(yaml.safe_dump(leg(desired={"orientation": {"deg": [0, 90, 0]}})))
    done = rbstab("stability", str(config), *SHORT, "--along", "controller.K_r=x0.6:x0.7:3")
    assert "is stable for" not in done.stdout


# Its weight turns it over its side: θ2 passes π/2 on the way down.
FALLS = """\
body: {mass: 41, inertia: [10, 9, 2], contact_point: [-0.0184, 0.0349, -0.0505]}
gravity: [-22.8, -224, 10.4]
controller:
  variant: visco-elastic
  K_r: [12.6, 0.11, 31.5]
  L_r: [60, 60, 42]
  K_t: [0.336, 4169, 1.19]
  L_t: [200, 200, 140]
  K_c: [1.04, 3.0, 3.47]
  L_c: [20, 20, 20]
initial: {angular_velocity: [0.1, 0.2, -0.1]}
integration: {duration: 0.01, samples: 3}
"""


@pytest.fixture
def falls(folder):
    (folder / "falls.yaml").write_text(FALLS)
    return "falls.yaml"


def test_global_stability_is_false(falls):
    done = success("stability", falls, "--json")
    (facts,) = json.loads(done.stdout)
    assert facts["proved"] is True
    assert facts["states"] == []
    assert facts["statements"][:3] == [
        f"Rest states: no rest state in the range; proved ({facts['examined']} boxes).",
        "Globally stable: false; no motion that stays in the range comes to rest.",
        "Certified region: none.",
    ]
    assert all(text.startswith("For all real θ1 and θ3") for text in facts["statements"][3:])
    lines = {line["check"]: line for line in facts["certificate"]["lines"]}
    assert lines["global stability"]["verdict"] == "violated"
    assert lines["global stability"]["value"] == 0
    assert lines["certified region"]["verdict"] == "unknown"
    assert facts["certificate"]["verdict"] != "certified"


def test_a_run_says_so_too(falls):
    success("run", falls, "--prove")
    result = open_result("results/falls.h5")
    verdicts = dict(zip(result["certificate/check"], result["certificate/verdict"], strict=True))
    assert verdicts["global stability"] == "violated"
    told = "no rest state was found in the range of eq. 5"
    assert told in str(result.attributes["warnings"]).splitlines()
    assert result.attributes["lyapunov_zero"] == told
