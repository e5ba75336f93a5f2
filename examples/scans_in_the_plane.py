"""Two sweeps of a 2D laser scanner: points (N, 2) are registered in the plane, from any pose."""

import numpy as np

import fieldalign as fa

CORNERS = np.array([[0, 0], [9, 0], [9, 4], [6, 4], [6, 7], [0, 7]], float)  # an L-shaped room, metres
BOXES = [np.array(box) for box in (
    [[2, 3], [3.2, 3.4], [3.0, 4.1], [1.8, 3.7]], [[7.2, 0.6], [8.4, 0.3], [8.6, 1.2], [7.4, 1.5]],
    [[0.4, 0.4], [1.1, 0.4], [1.1, 1.3], [0.4, 1.3]], [[2.2, 5.9], [3.8, 6.3], [3.7, 6.7], [2.1, 6.3]],
)]


def sweep(eye, noise, rng, beams=1080):
    """Where the beams from a place hit the walls."""
    angles = np.linspace(-3.1, 3.1, beams)
    beam = np.c_[np.cos(angles), np.sin(angles)]
    nearest = np.full(beams, np.inf)
    for outline in (CORNERS, *BOXES):
        for start, end in zip(outline, np.roll(outline, -1, axis=0), strict=True):
            away, along = start - eye, end - start
            across = beam[:, 0] * along[1] - beam[:, 1] * along[0]
            reach = (away[0] * along[1] - away[1] * along[0]) / across
            share = (away[0] * beam[:, 1] - away[1] * beam[:, 0]) / across
            hits = (reach > 0) & (share >= 0) & (share <= 1)
            nearest = np.where(hits & (reach < nearest), reach, nearest)
    return (nearest + rng.normal(0, noise, beams))[:, None] * beam


rng = np.random.default_rng(0)
one, other = np.array([4.5, 2.0]), np.array([4.0, 5.5])
angle = np.radians(130)
turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
target, source = sweep(one, 0.01, rng), sweep(other, 0.01, rng) @ turn  # each in its scanner's own frame

result = fa.register(source, target)
print(result.verdict)
print(result.T_target_source)
truth = np.block([[turn, (other - one)[:, None]], [np.zeros(2), 1]])
print("largest error of the pose:", np.abs(result.T_target_source - truth).max().round(4))
