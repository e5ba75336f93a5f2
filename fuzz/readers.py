"""Coverage-guided fuzzing of every reader: a right-shaped answer or a documented exception, in bounded time and memory.

    python fuzz/readers.py TARGET[,TARGET...] --work FOLDER [libFuzzer's options]        "all": every target

Of several targets, an input's first byte says which. What breaks a promise is written to FOLDER/failures, once for each
place in the code, and the search goes on; libFuzzer itself ends for a crash and for what takes longer than -timeout.
"""

from __future__ import annotations

import resource
import sys
import time
import warnings
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import atheris
import numpy as np

with atheris.instrument_imports(
    include=[
        "fieldalign.clouds.files",
        "fieldalign.clouds.formats",
        "fieldalign.fields.files",
        "fieldalign.fields.volume_files",
        "fieldalign.odometry.trajectory_files",
        "fieldalign.odometry.sequences",
        "fieldalign.assembly.record",
        "fieldalign.cli.poses",
        "fieldalign.cli.batch",
    ]
):
    from seeds import seeds

    import fieldalign as fa
    from fieldalign.assembly.record import RunRecord
    from fieldalign.cli.batch import read_rows
    from fieldalign.cli.poses import read_pose
    from fieldalign.fields.protocol import sampled
    from fieldalign.odometry.sequences.kitti import read_calibration
    from fieldalign.odometry.sequences.point_cloud2 import cloud_of
    from fieldalign.odometry.sequences.stamps import read_stamps

SECONDS = 2.0  # of an input of at most 16 KiB
MEMORY = 1 << 30  # bytes beyond what the libraries take when they are loaded
OURS = ("is float32 with coordinates", "is damaged, so its work", "created on Python 2")  # warnings that are meant


class BrokenPromiseError(Exception):
    """What a reader did that its documentation rules out."""


class Target(NamedTuple):
    """A reader of files: their suffix, what reads them, and what an input becomes before it is written."""

    suffix: str
    read: Callable[[Path], Any]
    written: Callable[[bytes], bytes] = bytes
    asks_for_more: bool = False  # rosbags reads as many bytes as a record promises: asked for, but not used


# ------------------------------------------------------------------------------------------------ what is read


def check_cloud(cloud: fa.PointCloud) -> None:
    if cloud.points.shape != (len(cloud), 3) or cloud.points.dtype not in (np.float32, np.float64):
        raise BrokenPromiseError(f"points of shape {cloud.points.shape}, {cloud.points.dtype}")


def read_cloud(path: Path) -> None:
    check_cloud(fa.read_cloud(path))


def read_scans(path: Path) -> None:
    for cloud in fa.read_clouds(path):
        check_cloud(cloud)


def read_field(path: Path) -> None:
    field = fa.fields.read_field(path)
    sampled(field, np.ascontiguousarray(field.bounds))


def read_bag(path: Path) -> None:
    for frame in fa.read_sequence(path):
        if frame.cloud is not None:
            check_cloud(frame.cloud)


def read_record(path: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of a damaged line, which it is meant to warn of
        with RunRecord(path.parent, {}, {"a": [1, 2]}) as record:
            dict(record.done)


class Message:
    """A PointCloud2 of any bytes."""

    def __init__(self, data: bytes) -> None:
        provider = atheris.FuzzedDataProvider(data)
        integers = lambda count: [provider.ConsumeUInt(4) for _ in range(count)]  # noqa: E731
        number = provider.ConsumeUInt(1) % 8
        self.height, self.width, self.point_step, self.row_step = integers(4)
        self.is_bigendian = provider.ConsumeBool()
        self.fields = [Field(provider) for _ in range(number)]
        self.data = np.frombuffer(provider.ConsumeBytes(provider.remaining_bytes()), np.uint8)


class Field:
    """One of its fields."""

    def __init__(self, provider: Any) -> None:
        names = ("x", "y", "z", "intensity", "t", "rgb", "ring", "timestamp", "")
        self.name = names[provider.ConsumeUInt(1) % len(names)]
        self.offset, self.datatype, self.count = (
            provider.ConsumeUInt(4),
            provider.ConsumeUInt(1),
            provider.ConsumeUInt(1),
        )


def read_message(path: Path) -> None:
    check_cloud(cloud_of(Message(path.read_bytes()), 1.0))  # type: ignore[arg-type]


# ------------------------------------------------------------------------------------------------ what is written

_POLYNOMIAL = 0x82F63B78  # CRC-32C, reflected


def _crc_table() -> np.ndarray:
    """(1020, 256): what each byte at each place of a page adds to its checksum."""
    table = np.arange(256, dtype=np.uint32)
    for _ in range(8):
        table = np.where(table & 1, (table >> 1) ^ _POLYNOMIAL, table >> 1).astype(np.uint32)
    rows = [table]
    for _ in range(1019):  # a byte one place earlier goes through one more zero
        rows.append(table[rows[-1] & 0xFF] ^ (rows[-1] >> 8))
    return np.array(rows[::-1])


_CRC = _crc_table()
_CRC_START = int(np.bitwise_xor.reduce(_CRC[np.arange(4), 0xFF]))  # of a register that begins with ones


def with_checksums(data: bytes) -> bytes:
    """An E57 file's pages of 1024 bytes, whose last four are right again."""
    pages = np.frombuffer(data[: len(data) // 1024 * 1024], np.uint8).reshape(-1, 1024).copy()
    sums = (
        np.bitwise_xor.reduce(_CRC[np.arange(1020), pages[:, :1020]], axis=1)
        ^ np.uint32(_CRC_START)
        ^ np.uint32(0xFFFFFFFF)
    )
    pages[:, 1020:] = sums.astype(">u4")[:, None].view(np.uint8)
    return pages.tobytes() + data[len(pages) * 1024 :]


_MEMBERS = ("", "points", "intensity", "viewpoint", "values", "origin", "truncation", "attributes/a", "seen")
_COMMON = {"points": np.eye(4, 3), "values": np.linspace(-1, 1, 27).reshape(3, 3, 3)}


def as_archive(data: bytes) -> bytes:
    """A first byte of 0, or of a real archive: as it is; else an archive whose member of that number is the rest."""
    number = data[0] if data else 0
    if not 0 < number < len(_MEMBERS):
        return data
    path = _scratch / "made.npz"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr(f"{_MEMBERS[number]}.npy", data[1:])
        base = "values" if number in (4, 5, 6, 8) else "points"
        if _MEMBERS[number] != base:
            with archive.open(f"{base}.npy", "w") as file:
                np.lib.format.write_array(file, _COMMON[base])
    return path.read_bytes()


def with_line_sums(data: bytes) -> bytes:
    """The lines of a record, with their checksums."""
    return b"".join(b"%08x %s\n" % (zlib.crc32(line), line) for line in data.split(b"\n"))


TARGETS = {
    suffix: Target(f".{suffix}", read_cloud)
    for suffix in ("ply", "pcd", "xyz", "csv", "npy", "bin", "las", "laz", "obj", "stl")
}
TARGETS |= {f"{suffix}_field": Target(f".{suffix}", read_field) for suffix in ("ply", "obj", "off", "stl", "nrrd")}
TARGETS |= {
    "npz": Target(".npz", read_cloud, as_archive),
    "npz_field": Target(".npz", read_field, as_archive),
    "e57": Target(".e57", read_scans, with_checksums),
    "trajectory": Target(".txt", fa.read_trajectory),
    "stamps": Target(".txt", read_stamps),
    "calibration": Target(".txt", read_calibration),
    "pose_txt": Target(".txt", lambda path: read_pose(str(path))),
    "pose_json": Target(".json", lambda path: read_pose(str(path))),
    "pose_npy": Target(".npy", lambda path: read_pose(str(path))),
    "pairs": Target(".csv", read_rows),
    "record": Target(".jsonl", read_record, with_line_sums),
    "message": Target(".msg", read_message),
    "bag": Target(".bag", read_bag, asks_for_more=True),
    "mcap": Target(".mcap", read_bag, asks_for_more=True),
}

# ------------------------------------------------------------------------------------------------ promises

_scratch = Path()


def watch(target: Target, path: Path) -> None:
    """Reads a file; raises for anything but an answer or an exception of ours, in time and memory."""
    begun = time.process_time()
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        try:
            target.read(path)
        except fa.FieldalignError as error:
            if (reason := _hidden(error)) and not (target.asks_for_more and reason.startswith("memory")):
                raise BrokenPromiseError(reason) from error
    loud = [w for w in heard if not any(text in str(w.message) for text in OURS) and w.category is not ResourceWarning]
    if loud:
        at = f"{Path(loud[0].filename).name}:{loud[0].lineno}"
        raise BrokenPromiseError(f"{loud[0].category.__name__} from {at}: {loud[0].message}")
    if time.process_time() - begun > SECONDS:
        raise BrokenPromiseError(f"took {time.process_time() - begun:.1f} s")


def _hidden(error: BaseException | None) -> str | None:
    """What is a failure of ours behind a refusal: memory that was asked for, or a slip in our code."""
    while error is not None:
        if isinstance(error, MemoryError) or "bad_alloc" in str(error):
            return f"memory: {error!r}"
        if isinstance(error, (NameError, AttributeError, AssertionError, RecursionError)):
            return repr(error)
        error = error.__cause__
    return None


def place_of(error: BaseException) -> str:
    """Where it was raised, as a name for a file."""
    while error.__cause__ is not None:
        error = error.__cause__
    last = error.__traceback__
    while last is not None and last.tb_next is not None:
        last = last.tb_next
    where = "" if last is None else f"{Path(last.tb_frame.f_code.co_filename).stem}-{last.tb_lineno}"
    told = f"-{zlib.crc32(str(error).encode()) % 1000}" if isinstance(error, BrokenPromiseError) else ""
    return f"{type(error).__name__}-{where}{told}"


def fuzz(names: list[str], work: Path, options: list[str]) -> None:
    """Hands libFuzzer the targets."""
    global _scratch
    _scratch = Path("/dev/shm" if Path("/dev/shm").is_dir() else work) / f"fieldalign-fuzz-{work.name}"
    failures, corpus = work / "failures", work / "corpus"
    for folder in (_scratch, failures, corpus):
        folder.mkdir(parents=True, exist_ok=True)
    for name in names:
        for k, data in enumerate(seeds(name, _scratch)):
            (corpus / f"seed-{name}-{k}").write_bytes(data if len(names) == 1 else bytes([names.index(name)]) + data)
    for name in names:  # the libraries load what they load
        one_input(b"" if len(names) == 1 else bytes([names.index(name)]), names, failures)
    held = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (held + MEMORY, resource.RLIM_INFINITY))
    arguments = [
        sys.argv[0],
        str(corpus),
        f"-artifact_prefix={failures}/",
        "-timeout=20",
        "-rss_limit_mb=4096",
        "-max_len=16384",
        "-print_final_stats=1",
        *options,
    ]
    atheris.Setup(arguments, lambda data: one_input(data, names, failures))
    atheris.Fuzz()


def one_input(data: bytes, names: list[str], failures: Path) -> None:
    """Tries one input; a broken promise is written down."""
    name, data = (names[0], data) if len(names) == 1 else (names[(data or b"\0")[0] % len(names)], data[1:])
    target = TARGETS[name]
    path = _scratch / f"{'record' if name == 'record' else 'input'}{target.suffix}"
    path.write_bytes(target.written(data))
    try:
        watch(target, path)
    except (KeyboardInterrupt, SystemExit):
        raise
    except BaseException as error:  # a panic in Rust is no Exception
        found = failures / f"{name}-{place_of(error)}"
        if not found.exists():
            found.write_bytes(path.read_bytes())
            print(f"FAILURE {found.name}: {type(error).__name__}: {str(error)[:200]}", flush=True)


if __name__ == "__main__":
    given = list(TARGETS) if sys.argv[1] == "all" else sys.argv[1].split(",")
    fuzz(
        given,
        Path(sys.argv[sys.argv.index("--work") + 1]),
        [a for a in sys.argv[2:] if a.startswith("-") and a != "--work"],
    )
