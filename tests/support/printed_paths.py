"""Paths and commands as the program prints them on the system that runs the tests."""

import os
import shlex
import sys


def printed(text):
    """Return a text with the separators of this system in place of the slashes of its paths."""
    return text.replace("/", os.sep)


def words_of(line):
    """Return the words of a printed command, as a shell of this system reads them."""
    return read_by_windows(line) if sys.platform == "win32" else shlex.split(line)


def read_by_windows(line):
    """Return the words that a program of Windows receives: the rules of its C library."""
    words: list[str] = []
    word, in_quotes, backslashes = "", False, 0
    for letter in f"{line} ":
        if letter == "\\":
            backslashes += 1
            continue
        if letter == '"':
            word += "\\" * (backslashes // 2)
            if backslashes % 2:
                word += '"'
            else:
                in_quotes = not in_quotes
        else:
            word += "\\" * backslashes
            if letter == " " and not in_quotes:
                words.append(word)
                word = ""
            else:
                word += letter
        backslashes = 0
    return words
