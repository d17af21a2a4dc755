"""`rbstab stability --along` says where a gain has no effect, and which modes its table omits."""

import json
import re
from pathlib import Path

import pytest
import yaml
from cli.conftest import Invoke
from support.leg import leg

CONFIGS = Path(__file__).parents[2] / "configs"

LAW = "K_s: [20000, 20000, 20000]\n  surface: {slope: 20}\n  law: exact\n  K_t"
SHORT = ("--no-run", "--search-only")


def test_a_gain_without_an_effect_has_one_row(folder: Path, rbstab: Invoke) -> None:
    text = Path("good.yaml").read_text().replace("variant: free", "variant: sliding")
    Path("sliding.yaml").write_text(text.replace("K_t", LAW, 1))
    done = rbstab("stability", "sliding.yaml", *SHORT, "--along", "controller.K_s=0.5:2:5")
    assert done.exit_code == 0, done.output
    assert "controller.K_s does not change the linearised system." in done.stdout
    table = done.stdout.partition("Along controller.K_s")[2].partition("Not listed")[0]
    assert len([line for line in table.splitlines() if line.strip()]) == 4
    assert "E decays as exp(-κt), κ = 20 1/s" in done.stdout


def test_round_off_is_not_printed_as_an_oscillation(rbstab: Invoke) -> None:
    """A damper gives two axes of this body the same two real eigenvalues."""
    config = str(CONFIGS / "examples" / "real_body.yaml")
    done = rbstab("stability", config, *SHORT, "--along", "controller.K_r=0.5:2:3")
    assert done.exit_code == 0, done.output
    assert "-24.42" in done.stdout
    assert " ± " in done.stdout.partition("Along")[2]
    assert not re.search(r"e-\d+i", done.stdout)


def test_the_gain_from_which_on_a_leg_stands_is_named(rbstab: Invoke, tmp_path: Path) -> None:
    """Upright is stable for K_r > m g l = 6.386 N m/rad."""
    config = tmp_path / "leg.yaml"
    config.write_text(yaml.safe_dump(leg()))
    along = ("--along", "controller.K_r=0.6:0.7:3")
    done = rbstab("stability", str(config), *SHORT, *along)
    assert done.exit_code == 0, done.output
    text = " ".join(done.stdout.split())
    assert "K_r[0] [N m/rad]" in text
    values = [10 * 0.6 * (0.7 / 0.6) ** (k / 2) for k in range(3)]
    assert all(f" {value:.4g} " in text for value in values)
    sentence = (
        "The body at rest at its desired attitude, upright (default), within 10°, is stable for "
        "K_r[0] ≥ 6.481 N m/rad; unstable there for ≤ 6.000 (by the eigenvalues)."
    )
    assert sentence in text
    (found,) = json.loads(rbstab("stability", str(config), *SHORT, *along, "--json").stdout)
    (locus,) = found["along"]
    assert locus["number"] == "K_r[0]"
    assert [point["value"] for point in locus["points"]] == pytest.approx(values)
    assert f"{locus['stable'][:1].upper()}{locus['stable'][1:]}." == sentence


def test_a_rest_state_that_leans_too_far_is_not_the_desired_one(
    rbstab: Invoke, tmp_path: Path
) -> None:
    config = tmp_path / "leg.yaml"
    config.write_text(yaml.safe_dump(leg(desired={"orientation": {"deg": [0, 90, 0]}})))
    done = rbstab("stability", str(config), *SHORT, "--along", "controller.K_r=0.6:0.7:3")
    assert "is stable for" not in done.stdout
