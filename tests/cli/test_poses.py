"""Poses as people and other programs write them."""

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.cli.poses import read_pose


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.json", b"[[1, 0, 0], [0, 1], 3]"),
        ("a.json", b"[" * 100_000),
        ("a.json", b'{"T_target_source": {"a": 1}}'),
        ("a.npy", b"\x93NUMPY\x01\x00\x20\x00{'descr': '<f8', 'shape': (4L,      \n"),
        ("a.npy", b"\x93NUMPY\x02\x00\xff\xff\xff\x7f{}"),
        ("a.npy", b"\x93NUMPY\xff\xff"),
        ("a.npy", b"\x93NUMPY\x01\x00\x20\x00{'descr': '<f8', 'shape': (04,)}   \n"),
        ("a.txt", b""),
        ("a.txt", b"# nothing\n"),
        ("a.txt", b"\xff\xfe"),
        ("a.txt", b"1 2 3\n"),
    ],
)
def test_what_is_no_pose_is_one_clear_error(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(fa.ArgumentError, match=r"^init must "):
        read_pose(str(tmp_path / name))


@pytest.mark.parametrize(
    "text", ["1 0 0 5\n0 1 0 6\n0 0 1 7\n0 0 0 1\n", "# a pose\n1,0,0,5, 0,1,0,6\n0 0 1 7 0 0 0 1 # end\n"]
)
def test_text_in_any_lines(tmp_path, text):
    (tmp_path / "a.txt").write_text(text)
    assert np.array_equal(read_pose(str(tmp_path / "a.txt"))[:3, 3], [5, 6, 7])
