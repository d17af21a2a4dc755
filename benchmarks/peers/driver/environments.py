"""Virtual environments of the peers, below `.peers`."""

import subprocess
import sys
from pathlib import Path

from benchmarks.peers.driver.catalogue import Peer

ROOT = Path(__file__).parents[3]
FOLDER = ROOT / ".peers"
LONGEST = 900
"""The longest wall time of an installation, s."""


class NotInstalledError(Exception):
    """The environment of a peer could not be made; the text is the reason."""


def python_of(peer: Peer) -> Path:
    """Return the interpreter of a peer's environment; make the environment if it is missing.

    Raises:
        NotInstalledError: Its packages cannot be installed.
    """
    if not peer.packages:
        return Path(sys.executable)
    folder = FOLDER / peer.environment
    python = folder / "bin" / "python"
    # The stamp is written last, so a broken installation never counts as complete.
    stamp, packages = folder / ".installed", " ".join(peer.packages)
    if not stamp.exists() or stamp.read_text() != packages:
        print(f"installing {packages} in {FOLDER.name}/{folder.name}", flush=True)
        _run([sys.executable, "-m", "venv", "--clear", str(folder)])
        pip = [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
        _run([*pip, *peer.packages])
        stamp.write_text(packages)
    return python


def _run(command: list[str]) -> None:
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=LONGEST, check=False)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise NotInstalledError(str(error)) from error
    if done.returncode:
        raise NotInstalledError(last_line(done.stderr or done.stdout))


def last_line(text: str) -> str:
    """Return the last line of a text that is not empty: the message of an error."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    return lines[-1] if lines else "no message"
