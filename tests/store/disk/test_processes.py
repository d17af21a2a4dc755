"""Protects files from concurrent and killed writers, with real processes."""

import subprocess
import sys

SIZE = 4_000_000

RACER = """
import sys
from pathlib import Path
from rbstab.store.disk.atomic import atomic_file, write_all
from rbstab.store.errors import ResultExistsError
folder, me = Path(sys.argv[1]), sys.argv[2]
for index in range({rounds}):
    try:
        with atomic_file(folder / f"{{index}}.h5") as file:
            write_all(file, me.encode() * {size})
            print("ready", flush=True)
            sys.stdin.readline()
    except ResultExistsError:
        print("lost", flush=True)
    else:
        print("won", flush=True)
"""


def spawn(script, *arguments):
    return subprocess.Popen(
        [sys.executable, "-c", script, *map(str, arguments)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )


def test_one_of_several_writers_wins(tmp_path):
    rounds = 40
    script = RACER.format(rounds=rounds, size=SIZE // 20)
    racers = {me: spawn(script, tmp_path, me) for me in "abcd"}
    for index in range(rounds):
        path = tmp_path / f"{index}.h5"
        # All racers have written their content and the name is free: now they race for it.
        for racer in racers.values():
            assert racer.stdout.readline() == "ready\n"
        assert not path.exists()
        for racer in racers.values():
            racer.stdin.write("go\n")
            racer.stdin.flush()
        ends = {me: racer.stdout.readline().strip() for me, racer in racers.items()}
        assert sorted(ends.values()) == ["lost", "lost", "lost", "won"]
        winner = next(me for me, end in ends.items() if end == "won")
        assert path.read_bytes() == winner.encode() * (SIZE // 20)
    for racer in racers.values():
        racer.communicate(timeout=60)
        assert racer.returncode == 0
    assert len(list(tmp_path.iterdir())) == rounds
