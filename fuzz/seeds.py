"""Small valid inputs for each reader, made by our own writers where there is one."""

from __future__ import annotations

import io
import json
import shutil
import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np

import fieldalign as fa
from fieldalign.assembly.pair_result import PairResult
from fieldalign.fields.files import write_mesh

CORNERS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
POSE = np.eye(4)


def clouds() -> list[fa.PointCloud]:
    """Bare points, and points with all that can belong to them."""
    rng = np.random.default_rng(0)
    n = 9
    bare = fa.PointCloud(rng.normal(size=(n, 3)))
    full = fa.PointCloud(
        rng.normal(size=(n, 3)).astype(np.float32),
        normals=np.eye(3)[np.arange(n) % 3],
        times=np.linspace(0, 0.1, n),
        intensity=np.arange(n, dtype=np.float32),
        colors=rng.integers(0, 256, (n, 3)).astype(np.uint8),
        attributes={"ring": np.arange(n, dtype=np.int32)},
        viewpoint=POSE,
    )
    return [bare, full]


def seeds(target: str, folder: Path) -> list[bytes]:
    """Inputs of a target; what has to be written to files is written to the folder."""
    suffix = target.partition("_")[0]
    if suffix in ("ply", "pcd", "xyz", "csv", "npy", "bin", "las", "laz", "e57", "npz"):
        return _written(folder / f"seed.{suffix}") + EXTRA.get(target, [])
    if suffix in ("obj", "off", "stl"):
        write_mesh(folder / f"seed.{suffix}", CORNERS, FACES)
        return [(folder / f"seed.{suffix}").read_bytes(), *EXTRA.get(target, [])]
    return _bags(folder, suffix) if suffix in ("bag", "mcap") else EXTRA[target]


def _written(path: Path) -> list[bytes]:
    found = []
    for cloud in clouds():
        fa.write_cloud(path, cloud)
        found.append(path.read_bytes())
    return found


def _bags(folder: Path, kind: str) -> list[bytes]:
    """A bag of either version with two scans of four points."""
    from rosbags import rosbag1, rosbag2
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC if kind == "bag" else Stores.ROS2_HUMBLE)
    types, path = store.types, folder / f"seed.{kind}"
    shutil.rmtree(path, ignore_errors=True)
    path.unlink(missing_ok=True)
    plugin = rosbag2.StoragePlugin.MCAP
    writer = rosbag1.Writer(path) if kind == "bag" else rosbag2.Writer(path, version=9, storage_plugin=plugin)
    serialize = store.serialize_ros1 if kind == "bag" else store.serialize_cdr
    name, sequence = "sensor_msgs/msg/PointCloud2", {"seq": 0} if kind == "bag" else {}
    header = types["std_msgs/msg/Header"](
        **sequence, stamp=types["builtin_interfaces/msg/Time"](sec=1, nanosec=2), frame_id="lidar"
    )
    fields = [types["sensor_msgs/msg/PointField"](axis, 4 * k, 7, 1) for k, axis in enumerate("xyz")]
    data = CORNERS.astype("<f4").view(np.uint8).ravel()
    message = types[name](
        header=header,
        height=1,
        width=4,
        fields=fields,
        is_bigendian=False,
        point_step=12,
        row_step=48,
        data=data,
        is_dense=True,
    )
    with writer:
        connection = writer.add_connection("/points", name, typestore=store)
        for k in range(2):
            writer.write(connection, k, serialize(message, name))
    return [path.read_bytes() if kind == "bag" else next(path.glob("*.mcap")).read_bytes()]


def _npy(array: Any) -> bytes:
    file = io.BytesIO()
    np.save(file, array)
    return file.getvalue()


def _record() -> list[bytes]:
    failed = PairResult.failed("a", "b", "no such file").to_dict()
    lines = [{"run": {"format": 1}, "scans": {"a": [1, 2]}}, {"key": "k", "result": failed}, {"key": "l", "result": {}}]
    return ["\n".join(json.dumps(line) for line in lines).encode()]


def _pcd(encoding: str) -> bytes:
    head = "VERSION .7\nFIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\nWIDTH 2\nHEIGHT 1\n"
    head += f"VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA {encoding}\n"
    if encoding == "ascii":
        return (head + "1 2 3 4\n5 6 7 8\n").encode()
    packed = b"\x1f" + bytes(32)  # lzf: a literal run of 32 bytes
    return head.encode() + struct.pack("<II", len(packed), 32) + packed


def _nrrd(more: str, data: bytes) -> bytes:
    return (
        "NRRD0004\ntype: float\ndimension: 3\nsizes: 3 3 3\nendian: little\nspace dimension: 3\n"
        f"space directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)\n{more}\n\n"
    ).encode() + data


def _message() -> bytes:
    fields = b"".join(struct.pack("<BIBB", k, 4 * k, 7, 1) for k in range(4))
    return struct.pack("<BIIIIB", 4, 1, 2, 16, 32, 0) + fields + np.arange(8, dtype="<f4").tobytes()


_VOLUME = np.linspace(-1, 1, 27).reshape(3, 3, 3).astype("<f4")
_PLY = "ply\nformat {} 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n{}end_header\n"
_PLY_FACES = "element face 2\nproperty list uchar int vertex_indices\n"
_ASCII = (_PLY.format("ascii", _PLY_FACES) + "0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 1 2\n4 0 1 2 3\n").encode()
_BIG = (
    _PLY.format("binary_big_endian", _PLY_FACES).encode()
    + CORNERS.astype(">f4").tobytes()
    + (struct.pack(">B3i", 3, 0, 1, 2) + struct.pack(">B4i", 4, 0, 1, 2, 3))
)
_TUM = b"# time x y z qx qy qz qw\n0.0 1 2 3 0 0 0 1\n0.1 1 2 3 0 0 0.6 0.8\n"
_KITTI = b"1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 1 0 1 0 0 0 0 1 0\n"

EXTRA: dict[str, list[bytes]] = {
    "ply": [_ASCII, _BIG],
    "ply_field": [_ASCII, _BIG],
    "pcd": [_pcd("ascii"), _pcd("binary_compressed")],
    "xyz": [b"3\n0 0 0\n1 0 0\n0 1 0\n", b"// x y z intensity\n0;0;0;1\n", b"0 0 0 255 0 0\n1 1 1 0 0 255\n"],
    "npz": [b"\x01" + _npy(CORNERS), b"\x02" + _npy(np.arange(4.0)), b"\x03" + _npy(POSE)],
    "npz_field": [b"\x04" + _npy(_VOLUME), b"\x05" + _npy(np.array([0.0, 0, 0])), b"\x06" + _npy(np.array(1.0))],
    "npy": [_npy(np.zeros(3, [("x", "f4"), ("y", "f4"), ("z", "f4"), ("t", "u4")])), _npy(np.ones((4, 7), ">f8"))],
    "obj": [b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1/1/1 2//2 3 4\nf -1 -2 -3\n"],
    "obj_field": [b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1/1/1 2//2 3 4\nf -1 -2 -3\n"],
    "off_field": [b"COFF\n4 2 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 1 2 255 0 0\n4 0 1 2 3\n"],
    "stl": [
        b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 1\nvertex 0 1 0\nvertex 1 0 0\n"
        b"endloop\nendfacet\nendsolid a\n"
    ],
    "nrrd_field": [
        _nrrd("encoding: raw", _VOLUME.tobytes()),
        _nrrd("encoding: gzip", zlib.compress(_VOLUME.tobytes(), wbits=31)),
        _nrrd("encoding: ascii", " ".join(map(str, _VOLUME.ravel())).encode()),
    ],
    "trajectory": [_TUM, _KITTI],
    "stamps": [b"0.0\n0.1\n# comment\n1e9\n", b"2011-09-26 13:02:25.964389445\n"],
    "calibration": [b"P0: 1 2 3\nTr: 1 0 0 0 0 1 0 0 0 0 1 0\n"],
    "pose_txt": [b"1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"],
    "pose_json": [json.dumps({"T_target_source": POSE.tolist()}).encode(), json.dumps(POSE.tolist()).encode()],
    "pose_npy": [_npy(POSE)],
    "pairs": [b"source,target,init\na.ply,b.ply,\na.ply,c.ply,1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\n"],
    "record": _record(),
    "message": [_message()],
}
