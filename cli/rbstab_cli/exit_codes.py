"""The exit codes of every command."""

OK = 0

INTERNAL = 1
"""An exception that no code expects: Python prints its traceback and ends with this code."""

USAGE = 2
"""A config or the command line is wrong; nothing was run."""

NOT_COMPLETED = 3
"""At least one run, or every member of a sweep, did not complete; or a search found nothing."""

STORAGE = 4
"""At least one result could not be written or read, or a proof was refused by `rbstab verify`."""

TOO_LONG = 5
"""`rbstab verify` refused no proof, but the check of one takes too long."""

INTERRUPTED = 130
"""Ctrl-C; finished runs and shards are stored."""

READER_GONE = 141
"""Stdout or stderr is a pipe whose reader has ended, as in `| head`; a shell shows SIGPIPE so."""

TERMINATED = 143
"""SIGTERM, from a job system or `kill`; finished runs and shards are stored."""
