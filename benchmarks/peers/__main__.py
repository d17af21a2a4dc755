"""Measure all peers, and write the table into docs/performance.md."""

from benchmarks.peers.driver.page import write_table
from benchmarks.peers.driver.rows import measured_rows

write_table(measured_rows())
