"""Warnings about configs: numbers in another unit, motions that are not what is wanted."""
