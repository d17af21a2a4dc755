"""Protects `rbstab init --element` and `rbstab check --element`, and errors in code of users."""

from pathlib import Path

import pytest
from cli.conftest import GOOD, ended, rbstab, success
from support.proved_code import LETS_GO
from support.user_code import SPRING

from rbstab.elements.user_code.template import TEMPLATE

CONFIG = GOOD.replace("title: A short run", "schema_version: 2\ntitle: A spring") + (
    "elements:\n  mine: {kind: python, file: mine.py, class: Mine, parameters: {k: 3}}\n"
)


def test_the_template_is_written_and_passes(folder):
    done = success("init", "--element")
    assert Path("cubic_spring.py").read_text() == TEMPLATE
    assert "Next: rbstab check --element cubic_spring.py\n" in done.stderr
    done = success("check", "--element", "cubic_spring.py")
    first, *others = done.stdout.splitlines()
    assert first == "cubic_spring.py: CubicSpring: all statements hold at 100 random states"
    assert all(line.startswith("  holds  ") for line in others[:-1])
    assert others[-1] == "  note   proofs take it into account"
    assert len(others) >= 7


def test_the_line_for_a_config_works(folder):
    done = rbstab("init", "--element", "other.py")
    line = done.stderr.splitlines()[-1].removeprefix("In a config: ")
    Path("case.yaml").write_text(f"schema_version: 2\n{GOOD}{line}\n")
    done = success("check", "case.yaml", "--allow-python")


def test_wrong_files_are_all_told(folder):
    Path("wrong.py").write_text(SPRING.replace("0.5 *", "0.6 *"))
    Path("broken.py").write_text("class Mine(:\n")
    Path("mine.py").write_text(SPRING)
    arguments = [
        part for name in ("wrong.py", "broken.py", "mine.py") for part in ("--element", name)
    ]
    done = ended(2, "check", *arguments)
    assert "wrong.py: Mine: 1 statement does not hold\n" in done.stdout
    assert "  WRONG  the wrench on a body at rest is not the slope of `stored`" in done.stdout
    assert "mine.py: Mine: all statements hold" in done.stdout
    assert done.stderr.startswith("broken.py: cannot be run: line 1: SyntaxError: ")


def test_an_error_late_in_a_run_is_one_line(folder, monkeypatch, capsys):
    """The code may fail where it was not tried: a message with its line, and no traceback."""
    from rbstab_cli import main as program

    late = SPRING.replace(
        "return force_at_centre(",
        "if motion.X.dtype == float and np.abs(motion.Omega).max() != 2.0:\n"
        "            raise RuntimeError('late')\n        return force_at_centre(",
    )
    Path("mine.py").write_text(late)
    Path("case.yaml").write_text(CONFIG)
    monkeypatch.setattr("sys.argv", ["rbstab", "run", "case.yaml", "--allow-python", "-q"])
    with pytest.raises(SystemExit) as ended:
        program.main()
    assert ended.value.code == 2
    error = capsys.readouterr().err
    assert error == "error: mine.py: line 14: RuntimeError: late\n"


HELD = CONFIG.replace("variant: free", "variant: permanent")


def test_a_proof_with_code_is_made_and_verified(folder):
    Path("mine.py").write_text(SPRING)
    Path("case.yaml").write_text(HELD)
    done = success("stability", "case.yaml", "--allow-python")
    assert "Globally stable: proved" in done.stdout
    (proof,) = map(str, Path("results/proofs").iterdir())
    success("verify", proof)
    # Without permission the energy is not compared; nothing is refused for that.
    done = success("verify", proof, "--config", "case.yaml")
    assert "code of a user, which may not run without --allow-python" in done.stdout
    assert "is that of the config, as an exact expression" not in done.stdout
    done = success("verify", proof, "--config", "case.yaml", "--allow-python")
    assert "is that of the config, as an exact expression" in done.stdout
    Path("case.yaml").write_text(HELD.replace("k: 3", "k: 4"))
    ended(4, "verify", proof, "--config", "case.yaml", "--allow-python")


def test_rest_states_on_a_ridge_are_named(folder):
    """A spring that lets go, of a mast that its weight pushes over: it holds it, or does not."""
    Path("mine.py").write_text(LETS_GO)
    text = HELD.replace("{k: 3}", "{k: 9000, reach: 0.2}")
    Path("case.yaml").write_text(text)
    weight = ("--set", "gravity=[60,0,-9.81]")
    done = success("stability", "case.yaml", "--allow-python", "--no-run", *weight)
    assert "unstable, index 1, on a ridge" in done.stdout
    assert "on a ridge: the force of an element of your own jumps here" in done.stdout
    assert "held: a force" not in done.stdout
