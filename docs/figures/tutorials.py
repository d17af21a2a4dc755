"""Pictures of the tutorials: figures of the reports that their commands make.

`make figures` runs this script. The configs are those on the pages.
"""

import re
import sys
import tempfile
from contextlib import chdir
from pathlib import Path

from click.testing import CliRunner
from PIL import Image

from rbstab_cli.main import cli

DOCS = Path(__file__).parents[1]
PICTURES = DOCS / "pictures"
SAVED = re.compile(r"```yaml\n(# (\w+\.yaml)\b.*?)```", flags=re.DOTALL)


def run(*arguments: str) -> None:
    """Run a command line of rbstab; end the script if it fails."""
    done = CliRunner().invoke(cli, arguments)
    if done.exit_code:
        sys.exit(done.output)


def save_configs(page: str) -> None:
    """Save the configs of a page in the working folder."""
    for text, name in SAVED.findall((DOCS / page).read_text(encoding="utf-8")):
        Path(name).write_text(text, encoding="utf-8")


def take(result: str, figure: str, name: str) -> None:
    """Draw one figure of a report, and keep it."""
    run("plot", result, "--figure", figure, "-o", "figure.png", "--force")
    keep(name)


def keep(name: str) -> None:
    """Keep the drawn figure with 64 colours and half of its dots."""
    drawn = Image.open("figure.png").convert("RGB").reduce(2)
    drawn.quantize(64).save(PICTURES / name, optimize=True)


def main() -> None:
    """Run the tutorials as far as their pictures need it."""
    with tempfile.TemporaryDirectory() as folder, chdir(folder):
        save_configs("tutorial_sweep.md")
        run("run", "box.yaml", "-q")
        take("results/box.h5", "runs-rotation", "tutorial_box.png")
        run("sweep", "stiffness.yaml", "-q", "--no-prove")
        take("results/stiffness", "sweep-1-first", "tutorial_outcome.png")
        take("results/stiffness", "sweep-1-map", "tutorial_map.png")
        save_configs("tutorial_limits.md")
        along = ("--along", "controller.K_r[0]=1:10:10", "--figure", "figure.png", "--force")
        run("stability", "forearm.yaml", "--no-run", *along)
        keep("tutorial_branches.png")


if __name__ == "__main__":
    main()
