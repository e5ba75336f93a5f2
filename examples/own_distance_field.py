"""Anything that knows the distance to a surface can be registered: here a scan against a box given by a formula."""

import numpy as np

import fieldalign as fa

HALF_EDGES = np.array([1.0, 0.7, 0.4])


class Box:
    """The surface of a box about the origin: distance, gradient, foot and normal at any place."""

    signed = True
    bounds = np.stack([-HALF_EDGES, HALF_EDGES])

    def sample(self, x):
        outside = np.abs(x) - HALF_EDGES
        beyond = np.maximum(outside, 0)
        value = np.linalg.norm(beyond, axis=1) + np.minimum(outside.max(axis=1), 0)
        inside = np.eye(3)[outside.argmax(axis=1)]
        direction = np.where(value[:, None] > 0, beyond, inside) * np.where(x < 0, -1, 1)
        gradient = direction / np.linalg.norm(direction, axis=1, keepdims=True)
        return value, gradient, x - value[:, None] * gradient, gradient


rng = np.random.default_rng(0)
places = rng.uniform(-1.2, 1.2, (20_000, 3))
on_box = Box().sample(places)[2]

angle = np.radians(15)
T_scan_box = np.eye(4)
T_scan_box[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
T_scan_box[:3, 3] = 0.1, -0.05, 0.02
scan = fa.PointCloud(on_box).transformed(T_scan_box)

result = fa.register(Box(), scan, method="paper", settings=fa.PRESETS["indoor"].scaled(0.3))
print(result.reason)
print("largest error of the pose:", np.abs(result.T_target_source - T_scan_box).max().round(4))
