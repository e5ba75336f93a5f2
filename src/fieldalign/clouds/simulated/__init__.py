"""Simulated scans: rooms of boxes, cylinders and spheres, with true occlusion and range noise."""

from .pair import ScanPair, simulate_pair
from .primitives import Box, Cylinder, Primitive, Sphere, cast
from .room import Room, simulate_room
from .scene import Scene, ray_pattern

__all__ = [
    "Box",
    "Cylinder",
    "Primitive",
    "Room",
    "ScanPair",
    "Scene",
    "Sphere",
    "cast",
    "ray_pattern",
    "simulate_pair",
    "simulate_room",
]
