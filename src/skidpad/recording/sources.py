"""Opens whatever holds channels: our MCAP files, or ROS 2 bags with a mapping file."""

from __future__ import annotations

from hashlib import sha256
from pathlib import Path

from skidpad.core.errors import FileError
from skidpad.recording.channels.mcap_files import ChannelSource, McapRecording

BLOCK = 2**20  # bytes


def open_channels(path: Path, mapping: Path | None = None, truth: bool = True) -> ChannelSource:
    """Returns the recording at `path`; with `mapping` it is read as a ROS 2 bag.

    truth: whether an MCAP file's true world is read. FileError for a folder without a mapping, or none.
    """
    if mapping is not None:
        from skidpad.recording.formats.ros_bag import RosRecording

        return RosRecording(path, mapping)
    if path.is_dir():
        raise FileError(f"{path}: a folder is read as a ROS 2 bag, which needs --mapping FILE")
    if not path.exists():
        raise FileError(f"{path}: no such file")
    return McapRecording(path, truth)


def file_hash(path: Path) -> str:
    """Returns SHA-256 over the bytes of a recording: of the file, or of all files of a folder by name."""
    digest = sha256()
    for file in sorted(path.rglob("*")) if path.is_dir() else [path]:
        if not file.is_file():
            continue
        digest.update(file.relative_to(path).as_posix().encode(errors="surrogateescape"))
        try:
            with file.open("rb") as stream:
                while block := stream.read(BLOCK):
                    digest.update(block)
        except OSError as error:
            raise FileError(f"{file}: cannot be read ({error.strerror})") from error
    return digest.hexdigest()


def recordings_below(folder: Path) -> list[Path]:
    """Returns all .mcap files below `folder`, by name; FileError when there is none."""
    found = sorted(folder.rglob("*.mcap")) if folder.is_dir() else []
    if not found:
        raise FileError(f"{folder}: holds no .mcap recording")
    return found
