"""Neural fields: networks fitted to two scans, registered against a scan and against each other, from any pose.

A scan is an open surface and has no inside. So a network says two things of a place: how far it lies across the nearest
surface (positive on the sensor's side), and how far beside that surface's edge; the distance is both together. The
first runs smoothly through the surface, where the distance itself has a kink that no smooth network follows; the second
keeps the surface from going on where nothing was measured.

Needs PyTorch (pip install 'fieldalign[neural]'); about 20 seconds.
"""

import time

import numpy as np
import torch

import fieldalign as fa
from fieldalign.clouds.simulated import simulate_pair
from fieldalign.evaluation import rotation_error, translation_error
from fieldalign.motions import exp_twist, inverse

WIDTH, FREQUENCY = 128, 20.0
PLACES, PASSES, BATCH = 6, 2, 1024  # places to learn from for each point of a scan, and how often each is seen
BAND, GAP = 0.1, 0.04  # metres: how near the surface its sides are taught, and how far its points may lie apart


class Sines(torch.nn.Linear):
    """A layer of sines, and how it starts: SIREN (Sitzmann et al., NeurIPS 2020)."""

    def __init__(self, inputs, reach):
        super().__init__(inputs, WIDTH)
        torch.nn.init.uniform_(self.weight, -reach, reach)

    def forward(self, x):
        return torch.sin(FREQUENCY * super().forward(x))


class NeuralDistance(torch.nn.Module):
    """The distance to a surface in a box (2, 3)."""

    def __init__(self, box):
        super().__init__()
        self.register_buffer("middle", torch.tensor(box.mean(axis=0), dtype=torch.float32))
        self.half = float(np.ptp(box, axis=0).max()) / 2
        reach = np.sqrt(6 / WIDTH) / FREQUENCY
        last = torch.nn.Linear(WIDTH, 2)
        torch.nn.init.uniform_(last.weight, -reach, reach)
        self.layers = torch.nn.Sequential(Sines(3, 1 / 3), Sines(WIDTH, reach), Sines(WIDTH, reach), last)

    def across_and_beside(self, x):
        """Both (L,) of places (L, 3); a negative one beside the edge lies within."""
        return (self.half * self.layers((x - self.middle) / self.half)).unbind(dim=1)

    def forward(self, x):
        return together(*self.across_and_beside(x))


def together(across, beside):
    return torch.sqrt(across**2 + torch.relu(beside) ** 2 + 1e-12)  # never zero, where a root has no derivative


def lessons(scan, count):
    """Places (n, 3), whether it is known how far they lie across the scan, and that, or else their distance, (n,)."""
    field, rng = fa.fields.PointField(scan.points), np.random.default_rng(0)
    near = scan.points[rng.integers(0, len(scan), count // 2)] + rng.normal(0, BAND / 2, (count // 2, 3))
    places = np.concatenate([near, rng.uniform(*field.bounds, (count // 2, 3))])
    distance = field.sample(places).value
    means, normals, _ = field.surfels(places, 10)  # planes have less noise than points, and no gaps between them
    towards_sensor = np.sign(((scan.viewpoint[:3, 3] - means) * normals).sum(axis=1))
    across = towards_sensor * ((places - means) * normals).sum(axis=1)
    known = (distance < BAND) & (distance - np.abs(across) < GAP)
    return places, known, np.where(known, across, distance)


def fitted(scan):
    """The field of a network that has learnt the distance to a scan."""
    torch.manual_seed(0)
    places, known, told = map(torch.from_numpy, lessons(scan, PLACES * len(scan)))
    places, told = places.float(), told.float()
    box = np.stack([scan.points.min(axis=0), scan.points.max(axis=0)])
    network = NeuralDistance(box)
    steps = PASSES * len(places) // BATCH
    optimiser = torch.optim.Adam(network.parameters(), lr=1e-3)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, steps)
    for _ in range(steps):
        rows = torch.randint(len(places), (BATCH,))
        across, beside = network.across_and_beside(places[rows])
        wrong = torch.where(
            known[rows],
            (across - told[rows]).abs() + torch.relu(beside + GAP / 2),
            (together(across, beside) - told[rows]).abs(),
        )
        optimiser.zero_grad()
        (wrong / (told[rows].abs() + BAND)).mean().backward()
        optimiser.step()
        schedule.step()
    return fa.fields.CallableField(network, box)


if __name__ == "__main__":
    torch.set_num_threads(1)  # so small batches are not worth sharing
    scans = simulate_pair(seed=0, points=50_000, overlap=0.8)
    T_moved_source = exp_twist(np.array([1.5, -1.2, 2.0, 3.0, -2.0, 1.0]))  # by 159 degrees: no guess would help
    source = scans.source.transformed(T_moved_source)
    truth = scans.T_target_source @ inverse(T_moved_source)

    start = time.perf_counter()
    target_field, source_field = fitted(scans.target), fitted(source)
    print(f"two networks fitted in {time.perf_counter() - start:.1f} s")
    for what, given in (("scan", source), ("network", source_field)):
        result = fa.register(given, target_field)
        T = result.T_target_source
        print(f"{what} on network: {result.reason.value} in {sum(result.seconds.values()):.1f} s; {result.evidence}")
        print(f"  wrong by {rotation_error(T, truth):.3f} degrees, {1e3 * translation_error(T, truth):.1f} mm")
