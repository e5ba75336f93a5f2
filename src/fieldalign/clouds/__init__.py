"""Clouds: the type, reading and writing, thinning, simulated scans."""
