"""Experiments that are figures."""
