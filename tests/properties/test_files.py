"""Whatever is written comes back or is refused, and whatever is read is a cloud or is refused, without memory."""

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given
from strategies import clouds, examples, of_wrong_kind, refusing, right_points

import fieldalign as fa
from fieldalign.clouds.files import FORMATS
from fieldalign.fields.files import MESHES, VOLUMES
from fieldalign.reports import write_odometry_report, write_report

pytestmark = pytest.mark.filterwarnings("ignore:.*is float32 with coordinates:UserWarning")

WRITABLE = [suffix for suffix, form in FORMATS.items() if form.write]
FAST = [suffix for suffix in WRITABLE if suffix not in (".las", ".laz", ".e57")]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("files")


@st.composite
def whole_clouds(draw):
    """PointClouds with anything that belongs to them."""
    points = draw(right_points())
    n = len(points)
    rng = np.random.default_rng(n)
    parts = {
        "normals": rng.normal(size=(n, 3)),
        "times": np.arange(n) * 0.1,
        "intensity": rng.integers(0, 70_000, n),
        "colors": rng.integers(0, 256, (n, draw(st.sampled_from((3, 4))))).astype(np.uint8),
        "viewpoint": np.eye(4),
    }
    chosen = draw(st.sets(st.sampled_from(sorted(parts))))
    kinds = st.sampled_from(("f8", "f4", "f2", "i8", "u8", "u1", "?", ">f8", "U3", "c16"))
    names = st.text(max_size=5) | st.sampled_from(("x", "nx", "time", "intensity", "points", "viewpoint", "red"))
    attributes = draw(st.dictionaries(names, kinds, max_size=3))
    dtype = draw(st.sampled_from(("f8", "f4")))
    with np.errstate(over="ignore"):
        points = points.astype(dtype)
    return fa.PointCloud(
        points,
        **{name: parts[name] for name in chosen},
        attributes={name: np.arange(n).astype(kind) for name, kind in attributes.items()},
    )


@pytest.mark.parametrize("suffix", WRITABLE)
@examples(12)
@given(st.one_of(whole_clouds(), clouds()))
def test_what_is_written_comes_back(folder, suffix, cloud):
    path = folder / f"cloud{suffix}"
    with refusing():
        fa.write_cloud(path, cloud)
        with refusing() if suffix == ".bin" else np.errstate():  # values that no KITTI file has
            back = fa.read_cloud(path)
            given_ = cloud if isinstance(cloud, fa.PointCloud) else fa.PointCloud(cloud)
            assert back.points.shape == given_.points.shape or suffix in (".las", ".laz")  # LAS has no missing returns


@pytest.mark.parametrize("suffix", [*FORMATS, *(set(MESHES) - set(FORMATS)), *VOLUMES])
@examples(25)
@given(
    st.one_of(
        st.binary(max_size=200),
        st.text(max_size=100).map(str.encode),
        st.from_regex(r"(ply|OFF|v|f|\d|\.|-|e|,| |\n){1,60}").map(str.encode),
    )
)
def test_any_bytes(folder, suffix, content):
    path = folder / f"any{suffix}"
    path.write_bytes(content)
    if suffix in FORMATS:
        with refusing():
            assert fa.read_cloud(path).points.shape[1] == 3
    with refusing():
        assert np.shape(fa.fields.read_field(path).bounds) == (2, 3)


@examples(40)
@given(st.one_of(st.text(), of_wrong_kind().filter(lambda path: not isinstance(path, int | bytes))))
@pytest.mark.parametrize(
    "read", [fa.read_cloud, fa.read_clouds, fa.read_trajectory, fa.read_sequence, fa.fields.read_field]
)
def test_any_path(read, path):
    with refusing(TypeError):  # of what is no path, as Python's own
        read(path)


@examples(15)
@given(right_points((10, 40)), right_points((10, 40)), st.text(max_size=10), st.one_of(st.none(), st.text(max_size=20)))
def test_reports(folder, source, target, name, title):
    with refusing():
        result = fa.register(source, target)
        path = write_report(result, source, target, folder / "report.html", title=title)
        assert path.read_text(encoding="utf-8").startswith("<!")
    with refusing():
        write_report(fa.register(source, target), source, target, folder / name, title=title)


@examples(10)
@given(st.lists(right_points((3,)), min_size=1, max_size=4), st.one_of(st.none(), st.text(max_size=5)))
def test_report_of_a_drive(folder, steps, title):
    poses = np.tile(np.eye(4), (len(steps), 1, 1))
    poses[:, :3, 3] = [step.mean(axis=0) for step in steps]
    with refusing():
        write_odometry_report(fa.Trajectory(np.arange(len(steps)), poses), folder / "drive.html", title=title)
