"""The record of a run: nothing that was recorded is lost, and nothing else is believed."""

import errno
import json
import os
import zlib

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.assembly.identity import identity_of
from fieldalign.assembly.record import RunRecord

RUN = {"seed": 0, "settings": (1, 0.1)}
SCANS = {"a": ["file", 10, 123], "b": ["file", 20, 456]}


def opened(folder, run=RUN, scans=SCANS):
    return RunRecord(folder, run, scans)


@pytest.fixture
def folder(tmp_path):
    """A record with three results."""
    with opened(tmp_path / "run") as record:
        for number in range(3):
            record.add(f"key {number}", {"value": number / 7})
    return tmp_path / "run"


def lines_of(folder):
    return (folder / "record.jsonl").read_bytes().splitlines(keepends=True)


def write_lines(folder, lines):
    (folder / "record.jsonl").write_bytes(b"".join(lines))


def keys_of(folder, **changes):
    with opened(folder, **changes) as record:
        return list(record.done)


def test_what_is_recorded_is_there_again(folder):
    with opened(folder) as record:
        assert record.done == {f"key {number}": {"value": number / 7} for number in range(3)}
        record.add("more", {"value": 3})
    assert keys_of(folder) == ["key 0", "key 1", "key 2", "more"]
    assert len(lines_of(folder)) == 5
    header = json.loads(lines_of(folder)[0][9:])
    assert header["run"]["version"] == fa.__version__
    assert header["scans"] == SCANS


def test_a_run_without_scans_is_a_run(tmp_path):
    with opened(tmp_path, scans={}) as record:
        record.add("key", {})
    assert keys_of(tmp_path, scans={}) == ["key"]
    assert len(lines_of(tmp_path)) == 2
    write_lines(tmp_path, lines_of(tmp_path)[1:])
    with pytest.raises(fa.RunError, match="is no record"):
        opened(tmp_path)


def test_a_result_is_there_before_the_record_is_closed(folder):
    with opened(folder) as record:
        record.add("more", {})
        assert len(lines_of(folder)) == 5


@pytest.mark.parametrize("kept", [1, 10, -1])
def test_a_torn_end_is_cut_off(folder, kept):
    whole = lines_of(folder)
    write_lines(folder, [*whole[:-1], whole[-1][:kept]])
    with opened(folder) as record:
        assert list(record.done) == ["key 0", "key 1"]
        record.add("key 2", {"value": 2 / 7})
    assert lines_of(folder) == whole


def test_a_damaged_end_is_cut_off(folder):
    whole = lines_of(folder)
    write_lines(folder, [*whole[:-1], whole[-1].replace(b"0.28", b"0.29")])
    assert keys_of(folder) == ["key 0", "key 1"]
    assert lines_of(folder) == whole[:-1]


def test_a_damaged_line_is_told_and_its_work_not_done(folder):
    whole = lines_of(folder)
    write_lines(folder, [*whole[:2], whole[2].replace(b"0.14", b"0.15"), whole[3]])
    with pytest.warns(UserWarning, match=r"record\.jsonl: line 3 is damaged"):
        assert keys_of(folder) == ["key 0", "key 2"]


@pytest.mark.parametrize("first", [b"hello\n", b"hello", b"00000000 {}\n"])
def test_what_is_no_record_is_refused_and_left(folder, first):
    write_lines(folder, [first])
    with pytest.raises(fa.RunError, match="is no record, or its first line is damaged"):
        opened(folder)
    assert lines_of(folder) == [first]


@pytest.mark.parametrize("kept", [0, 30])
def test_a_record_that_was_only_begun_begins_anew(folder, kept):
    write_lines(folder, [lines_of(folder)[0][:kept]])
    assert keys_of(folder) == []
    assert len(lines_of(folder)) == 1


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"run": RUN | {"seed": 1}}, "the setting seed was 0, but is 1"),
        ({"run": RUN | {"more": 1}}, "the setting more was None, but is 1"),
        ({"scans": SCANS | {"b": ["file", 20, 457]}}, "the scan b was"),
    ],
)
def test_other_inputs_are_one_clear_error(folder, changes, words):
    before = lines_of(folder)
    with pytest.raises(fa.RunError, match=words):
        opened(folder, **changes)
    assert lines_of(folder) == before
    assert len(keys_of(folder)) == 3  # and the lock is free


def test_another_version_is_another_run(folder, monkeypatch):
    monkeypatch.setattr(fa, "__version__", "99.0")
    with pytest.raises(fa.RunError, match=r"version was .* but is 99\.0"):
        opened(folder)


def test_scans_may_be_added_and_are_known_from_then_on(folder):
    assert len(keys_of(folder, scans=SCANS | {"c": ["file", 1, 1]})) == 3
    assert len(keys_of(folder)) == 3
    with pytest.raises(fa.RunError, match="the scan c was"):
        opened(folder, scans={"c": ["file", 2, 1]})


def test_a_full_disk_is_one_clear_error_and_loses_nothing(folder, monkeypatch):
    whole, write = lines_of(folder), os.write

    def half(file, data):
        """The disk takes ten bytes more."""
        if len(data) < 20:
            raise OSError(errno.ENOSPC, "No space left on device")
        return write(file, data[: len(data) - 10])

    record = opened(folder)
    record.add("key 3", {"value": 1})
    monkeypatch.setattr(os, "write", half)
    with pytest.raises(fa.RunError, match=r"the disk of .* is full"):
        record.add("key 4", {"value": 1})
    monkeypatch.undo()
    record.close()
    assert lines_of(folder)[:-1] == whole
    assert keys_of(folder) == ["key 0", "key 1", "key 2", "key 3"]


def test_only_one_may_write(folder):
    with opened(folder), pytest.raises(fa.RunError, match="is in use: another run writes there"):
        opened(folder)
    assert len(keys_of(folder)) == 3


def test_a_folder_that_cannot_be_made_is_one_clear_error(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(fa.RunError, match="cannot be written"):
        opened(tmp_path / "file" / "run")


# ---------------------------------------------------------------------------------------------- what tells a scan apart


def test_a_file_is_told_by_its_size_and_time(tmp_path):
    path = tmp_path / "scan.xyz"
    path.write_text("1 2 3")
    before = identity_of(path, "scan")
    assert identity_of(str(path), "scan") == before
    os.utime(path, ns=(1, 1))
    assert identity_of(path, "scan") != before
    assert identity_of(tmp_path / "nowhere.xyz", "scan") == ["file", None, None]


def test_points_are_told_by_their_content(corner):
    same = [corner, corner.copy(), fa.PointCloud(corner), corner.tolist()]
    assert len({str(identity_of(cloud, "cloud")) for cloud in same}) == 1
    assert identity_of(corner[::-1], "cloud") != identity_of(corner, "cloud")
    assert identity_of(fa.PointCloud(corner, viewpoint=np.eye(4)), "cloud") != identity_of(corner, "cloud")


def test_what_has_no_content_of_its_own_is_refused(corner):
    field = fa.fields.CallableField(lambda x: x[:, 0], bounds=[[0, 0, 0], [1, 1, 1]])
    with pytest.raises(fa.ArgumentError, match="clouds 3 cannot be told from another CallableField"):
        identity_of(field, "clouds 3")


@pytest.mark.parametrize(
    "text", [b"[1]", b"{", b"\xff", b"{}", b'{"key": 3, "result": {}}', b'{"run": 1}', b"[" * 5000, b"1"]
)
def test_a_line_that_is_no_record_but_has_a_right_checksum(folder, text):
    lines = lines_of(folder)
    write_lines(folder, [*lines[:2], b"%08x %s\n" % (zlib.crc32(text), text), *lines[2:]])
    with pytest.warns(UserWarning, match="line 3 is damaged"):
        assert keys_of(folder) == [f"key {number}" for number in range(3)]
