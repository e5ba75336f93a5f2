"""The native core of fieldalign: what loops over points."""

from collections.abc import Mapping
from typing import Any

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
    def surfels(self, queries: Floats, neighbours: int, threads: int) -> tuple[Floats, Floats, Floats]:
        """Means (n, 3) and unit normals (n, 3) of the planes through the k nearest points, and standard deviations
        (n, 2) across the plane and along its shorter axis."""
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

def occupancy(points: Points, most: int, threads: int) -> tuple[Floats, float, Floats, Floats]:
    """A box (2, 3) around the points but for far outliers, the edge of a cell around it, and for its k-th halving: how
    many cells hold two points or more (20,), and which share of the points they hold (20,). By at most `most` points,
    evenly taken."""

def thin(points: Points, bounds: Floats, voxel: float, threads: int) -> tuple[Floats, Places, Places]:
    """Mean (m, 3), first row (m,) and number (m,) of the points of each occupied voxel."""

def transform(R: Floats, t: Floats, points: Floats) -> Floats:
    """R (3, 3) times each of points (n, 3), plus t (3,)."""

def exp_twist(twist: Floats) -> Floats:
    """The motion (4, 4) that a twist (w, v) (6,) generates."""

def log_motion(T: Floats) -> Floats:
    """The twist (w, v) (6,) that generates a motion (4, 4), turning by at most pi."""

def relative_twist(A: Floats, B: Floats) -> Floats:
    """The twist (6,) of A^-1 B, of motions (4, 4)."""

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

class ClosestGrid:
    """The surfel closest to any place near a surface: looked up in a grid of cells, up to `margin` off."""

    def __init__(self, means: Floats, normals: Floats, cell: float, margin: float) -> None: ...
    def robust_sums(
        self,
        places: Floats,
        normals: Floats,
        offsets: Floats,
        poses: Floats,
        scale: float,
        min_cosine: float,
        reach: float,
        facing: bool,
        threads: int,
    ) -> tuple[Floats, Floats, Floats]:
        """H (b, 6, 6) and g (b, 6) of pseudo points (n, 3) under poses (b, 4, 4), and (b, 4): sums of weights, of
        weighted squares, of the loss's second derivatives, and how many were kept."""
    def agreement(
        self,
        places: Floats,
        normals: Floats,
        weights: Floats,
        poses: Floats,
        scale: float,
        min_cosine: float,
        reach: float,
        facing: bool,
        threads: int,
    ) -> Floats:
        """For each pose (b, 3): the weights (n,) of the surfels that agree with the surface, and of those near it,
        added up, and the share of all that lie on it."""

class Sight:
    """What a sensor at `eye` (3,) saw, points (N, 3), by directions: `cells` squared on each face of a cube."""

    def __init__(self, points: Floats, eye: Floats, cells: int) -> None: ...
    def ranges(self, places: Floats) -> Floats:
        """How far the sensor looked freely in the direction of each place (n, 3); NaN where it saw nothing (n,)."""

class PairTable:
    """Pairs of surfels at distances from `shortest` to `longest`, found again by what no rigid motion changes."""

    def __init__(self, means: Floats, normals: Floats, shortest: float, longest: float, threads: int) -> None: ...
    def __len__(self) -> int: ...
    def counts(self) -> NDArray[uint32]:
        """How many pairs there are of each look (k,)."""

def search(
    grid: ClosestGrid,
    table: PairTable,
    drawn_means: Floats,
    drawn_normals: Floats,
    probe_means: Floats,
    probe_normals: Floats,
    confinement: tuple[Floats, Floats, float, float] | None,
    freedoms: tuple[Floats, bool, Floats] | None,
    settings: Mapping[str, float],
    threads: int,
) -> tuple[Floats, Floats, int]:
    """Poses (c, 4, 4) that take the probes onto the grid's surface, best first, their scores (c,), and how many were
    tested. confinement: a guess (1, 4, 4), the pivot (3,), the radius, the cosine of the angle. freedoms: what stands
    left and right of a pose (2, 4, 4) in the motion that is free in part, whether it is inverted, the mask (6,)."""

def robust_sums(
    x: Floats,
    own_normals: Floats,
    means: Floats,
    normals: Floats,
    spreads: Floats,
    min_cosine: float,
    reach: float,
    deviations: float,
    least_scale: float,
) -> tuple[tuple[Floats, Floats, Floats], Floats, Floats, float]:
    """As ClosestGrid.robust_sums, of one pose: pseudo points x (n, 3), moved already, their planes (n, 3), and how
    widely each residual spreads (n,). The scale is so many standard deviations of the residuals themselves, or the
    least one. The seventh freedom is a growth about the origin. Then what holds the pose (7, 7), free of the normals'
    noise, the scatter (7, 7) of the gradient, and the scale."""

RUN: int  # neighbouring pseudo points whose gradients are added up before the scatter is taken

def coplanar(
    places: Floats,
    normals: Floats,
    witness_places: Floats,
    witness_normals: Floats,
    distance: float,
    min_cosine: float,
    threads: int,
) -> NDArray[uint32]:
    """For each surfel (n, 3), how many of the witnesses (m, 3) lie within `distance` of its plane, their normals within
    an angle of this cosine (n,)."""

def stretch(totals: Floats) -> Floats:
    """By how much to lengthen the steps that totals (b, 4) of robust_sums belong to (b,)."""

def take_steps(poses: Floats, H: Floats, g: Floats, stretch: Floats, largest_turn: float) -> tuple[Floats, Floats]:
    """Twists -stretch H^+ g (b, 6), turning by at most largest_turn, and the poses (b, 4, 4) that they lead to."""

Scan = NDArray[float32]  # (n, 4): a place in the sensor's frame, and seconds from the moment of the scan's pose

def thin_scan(
    points: Points, times: Floats | None, moment: float, stride: int, voxel: float, nearest: float, farthest: float
) -> Scan:
    """Of every stride-th point (n, 3) the first in each voxel, between two ranges; times (n,) are counted from the
    moment. Points that are not finite are left out."""

def thin_twice(scan: Scan, voxel: float, count: int) -> tuple[Scan, Scan]:
    """The first point of a scan in each voxel, and so many of these, evenly taken; of all, where
    these are too few."""

def deskew(scan: Scan, twist: Floats) -> Scan:
    """Each point as seen at the moment of the pose, by a sensor that moves at a steady twist (6,) a second."""

class VoxelMap:
    """A map that grows: voxels, in each of them the plane of its points."""

    def __init__(self, voxel: float) -> None: ...
    def __len__(self) -> int: ...
    def add(self, scan: Scan, pose: Floats, most: float) -> None:
        """A scan seen from a pose (4, 4) enters the voxels' sums, but for voxels of `most` points, which are full."""
    def keep_within(self, centre: Floats, radius: float) -> int:
        """Leaves the voxels within a radius of a place (3,), and returns how many they are."""
    def track(
        self,
        scan: Scan,
        start: Floats,
        origin: Floats,
        last: Floats | None,
        seconds: float,
        held: Floats | None,
        is_whole: bool,
        settings: Mapping[str, float],
    ) -> dict[str, Any]:
        """Where pseudo points (n, 4) come to lie, from a pose (4, 4) about the origin (3,), by Gauss-Newton.

        last: the pose (4, 4) about the origin, so many seconds ago: then the scan is deskewed. held: (6, 6), its
        columns are the twists that may be told from the scan. is_whole: voxels that are no planes hold, too, and planes
        along themselves. The answer holds motion (4, 4), H, hold and scatter (6, 6), stretch, scale, points, met (that
        have a plane), on (that lie on it), iterations, the lever over which turns and shifts are of one size, and the
        hold of the least held direction as a share of the best one's."""
    def planes(self, fewest: float) -> tuple[Floats, Floats, Floats, Floats]:
        """Means (n, 3), normals (n, 3), numbers of points (n,) and the two lesser variances (n, 2) of the cells that
        hold so many."""
