"""Odometry: a stream of scans becomes a trajectory and a map."""
