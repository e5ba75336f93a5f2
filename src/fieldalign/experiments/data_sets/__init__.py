"""Readers of the paper's data sets, each in the layouts in which people have it on disk.

Nothing is read before it is asked for: what a reader returns are small values that name files, and travel to workers.
"""
