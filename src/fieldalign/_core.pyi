"""The native core of fieldalign: what loops over points."""

from numpy import float32, float64, int64, uint32
from numpy.typing import NDArray

Floats = NDArray[float64]
Places = NDArray[uint32]
Points = NDArray[float32] | NDArray[float64]

class PointTree:
    """Exact nearest neighbours among n points (n, 3), float32 or float64, C-contiguous and finite."""

    def __init__(self, points: Points, threads: int) -> None: ...
    def __len__(self) -> int: ...
    def nearest(self, queries: Floats, neighbours: int, threads: int) -> tuple[Floats, NDArray[int64]]:
        """Distances (n, k) and rows (n, k) of the k nearest points, nearest first."""
    def sample(
        self, queries: Floats, neighbours: int, guess: Places | None, threads: int
    ) -> tuple[Floats, Floats, Floats, Places]:
        """value (n,), gradient (n, 3), foot (n, 3) and its place (n,) of the field of mean distance to the k nearest
        points; a place of an earlier sample, given as a guess, changes nothing but the time."""
    def normals(self, queries: Floats, neighbours: int, threads: int) -> Floats:
        """Unit normals (n, 3) of the planes through the k nearest points."""
    def rows(self, places: Places) -> Places:
        """Rows (n,) of places (n,) along the tree's curve."""
    def keypoints(
        self,
        salient_radius: float,
        non_max_radius: float,
        gamma_21: float,
        gamma_32: float,
        min_neighbours: int,
        threads: int,
    ) -> NDArray[uint32]:
        """Rows of the ISS keypoints, ascending."""

def survey(points: Points, threads: int) -> tuple[Floats, Floats]:
    """Lowest and highest corner (2, 3) and mean (3,) of points (n, 3); not finite where a coordinate is not."""

def thin(points: Points, bounds: Floats, voxel: float, threads: int) -> tuple[Floats, NDArray[uint32]]:
    """Mean (m, 3) and first row (m,) of the points of each occupied voxel."""

def transform(R: Floats, t: Floats, points: Floats) -> Floats:
    """R (3, 3) times each of points (n, 3), plus t (3,)."""

def exp_twist(twist: Floats) -> Floats:
    """The motion (4, 4) that a twist (w, v) (6,) generates."""

def directions(value: Floats, gradient: Floats) -> Floats:
    """Unit vectors (n, 3) away from the feet; zero where there is no gradient."""

def moment_rows(x: Floats, g: Floats) -> Floats:
    """Rows (n, 6) of x cross g, then g, of x and g (n, 3)."""

def direct(J: Floats, r: Floats) -> Floats:
    """The twist (6,) that minimises |J x + r|^2 over rows (n, 6), (n,)."""

def reweighted(
    J: Floats, r: Floats, w: Floats, floor: float, unit: float, tolerance: float, steps: int
) -> tuple[Floats, Floats]:
    """The twist (6,) that minimises sum |J x + r|, and the weights (n,) it ends with."""

def information(J: Floats, w: Floats) -> Floats:
    """sum w J^T J (6, 6), over rows (n, 6), (n,)."""

def count_equal(points: Floats) -> NDArray[int64]:
    """For each point (n, 3), how many of them equal it."""
