"""Hostile files that claim to be larger than they are, or hold compressed or repeated data."""

import zlib
from pathlib import Path

import h5py
from faults.hostile.registry import hostile_content, replaced, replaced_text

BILLION = 10**9
MEBIBYTE = 1 << 20


@hostile_content
def billion_in_chunks(file, name):
    """A few kilobytes that a reader expands to 8 GB of fill values."""
    replaced(file, name, shape=(BILLION,), chunks=(MEBIBYTE,), dtype="f8")


@hostile_content
def billion_never_written(file, name):
    replaced(file, name, shape=(BILLION,), dtype="f8", fillvalue=1.0)


@hostile_content
def gzip_bomb(file, name):
    """512 MB of zeros in half a megabyte."""
    chunk = zlib.compress(bytes(8 * MEBIBYTE), 9)
    new = replaced(
        file, name, shape=(64 * MEBIBYTE,), chunks=(MEBIBYTE,), dtype="f8", compression="gzip"
    )
    for number in range(64):
        new.id.write_direct_chunk((number * MEBIBYTE,), chunk)


@hostile_content
def one_text_of_a_billion_bytes(file, name):
    replaced(file, name, shape=(), dtype=f"S{BILLION}")


@hostile_content
def sizes_that_overflow(file, name):
    replaced(file, name, shape=(2**40, 2**22), chunks=(1, 1024), dtype="f8")


@hostile_content
def no_entries_but_a_huge_axis(file, name):
    replaced(file, name, shape=(0, 2**40), dtype="f8")


@hostile_content
def long_config(file, name):
    """20 MB of text; the file is as large."""
    replaced_text(file, "key: value\n" * (2 * MEBIBYTE))


@hostile_content
def config_of_many_keys(file, name):
    """15 MB of keys; parsing them would take minutes."""
    keys = "".join(f"k{number}: {number}\n" for number in range(MEBIBYTE))
    replaced_text(file, keys)


@hostile_content
def config_of_aliases(file, name):
    """Aliases of YAML that expand to 10^9 texts."""
    lines = (f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 10)}]" for n in range(1, 9))
    replaced_text(file, "\n".join(["a0: &a0 [x, x, x, x, x, x, x, x, x, x]", *lines]))


@hostile_content
def deep_config(file, name):
    replaced_text(file, "[" * 100_000)


@hostile_content
def many_references_to_onereplaced_text(file, name):
    """100,000 references to one text of 1 MB: 100 GB if each were read."""
    new = replaced(file, name, shape=(100_000,), dtype=h5py.string_dtype())
    new[0] = "x" * MEBIBYTE
    file.flush()
    raw = new.id.get_offset()
    path = file.filename
    file.close()
    content = bytearray(Path(path).read_bytes())
    content[raw : raw + 16 * 100_000] = content[raw : raw + 16] * 100_000
    Path(path).write_bytes(content)
