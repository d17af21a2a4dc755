"""A program that opens damaged copies of a result and prints the outcome of each."""

import sys
from pathlib import Path

import numpy as np

from rbstab.store.errors import StoreError
from rbstab.store.run_file import open_result


def main(image: Path, work: Path, seeds: range, places: tuple[int, int]) -> None:
    """Print `seed outcome` for each seed.

    Args:
        image: An undamaged result.
        work: The file for the damaged copies.
        seeds: One for each copy.
        places: The range of bytes that may be damaged, end excluded.
    """
    good = np.frombuffer(image.read_bytes(), dtype=np.uint8)
    for seed in seeds:
        rng = np.random.default_rng(seed)
        damaged, count = good.copy(), int(rng.integers(1, 20))
        where = rng.integers(*places, count)
        if seed % 2:
            damaged[where] = rng.integers(0, 256, count)
        else:
            damaged[where] ^= (1 << rng.integers(0, 8, count)).astype(np.uint8)
        work.write_bytes(damaged.tobytes())
        try:
            open_result(work)
            outcome = "result"
        except StoreError as error:
            outcome = type(error).__name__
        except BaseException as error:
            outcome = f"{type(error).__name__}: {error}"
        sys.stdout.write(f"{seed} {outcome}\n")
        sys.stdout.flush()


if __name__ == "__main__":
    first, last, begin, end = map(int, sys.argv[3:])
    main(Path(sys.argv[1]), Path(sys.argv[2]), range(first, last), (begin, end))
