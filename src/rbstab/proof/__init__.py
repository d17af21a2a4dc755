"""Proofs about rest states and motions: one exact expression, one search, one checker."""
