"""Experiments on scenes: Tables II to IV, and the trajectory."""
