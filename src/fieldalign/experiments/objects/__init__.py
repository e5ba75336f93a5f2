"""Experiments on objects: Table I, successes against thresholds, sparsity, noise, time and memory."""
