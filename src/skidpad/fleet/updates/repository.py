"""A maker's updates as the server keeps them: it signs when, never what."""

from __future__ import annotations

from collections.abc import Callable
from datetime import timedelta
from pathlib import Path
from typing import Any

from tuf.api.exceptions import RepositoryError
from tuf.api.metadata import Metadata, MetaFile, Root, Snapshot, Targets, Timestamp

from skidpad.core.errors import FileError, OutputError
from skidpad.core.text.told import on_a_line
from skidpad.fleet.updates.signing import instant, load_key
from skidpad.fleet.words import Refused, absent
from skidpad.recording.files import write_bytes

SNAPSHOT_VALID = timedelta(days=7)
TIMESTAMP_VALID = timedelta(days=1)
RENEW_S = 3600.0  # age of a timestamp after which it is signed anew
SIGNED_AT = "skidpad_signed_at"  # field of a timestamp: s since 1970, by the server's clock


class Repository:
    """Metadata and payloads in a folder; the online key signs snapshot and timestamp alone."""

    def __init__(self, folder: Path, online: Path, clock: Callable[[], float]) -> None:
        self.folder, self.clock = folder, clock
        self._online = online

    @property
    def there(self) -> bool:
        """Returns True when the repository has its first root of trust."""
        return (self.folder / "metadata" / "1.root.json").exists()

    def begin(self, root: bytes, targets: bytes) -> None:
        """Writes the first root and list of updates; OutputError when there is a root already."""
        if self.there:
            raise OutputError(f"{self.folder} has a root already")
        self._write("1.root.json", root)
        self._publish(targets)

    def targets(self) -> bytes:
        """Returns the current list of updates as it was signed; Refused (404) before the first."""
        return self.metadata(f"{self._version('snapshot', 'targets.json')}.targets.json")

    def publish(self, targets: bytes, name: str, content: bytes) -> None:
        """Takes a list of updates that was signed off line, and the payload that it adds.

        Refused (422) unless two of three signed it, it has the next version and has not expired, keeps
        all that was there, adds only `name`, and names exactly this content.
        """
        try:
            new: Metadata[Targets] = Metadata.from_bytes(targets)
            self._root().signed.verify_delegate("targets", new.signed_bytes, new.signatures)
        except (RepositoryError, ValueError) as error:
            raise Refused(
                422, f"the list of updates is not signed as it must be: {on_a_line(error)}"
            ) from error
        old: Metadata[Targets] = Metadata.from_bytes(self.targets())
        if new.signed.type != "targets" or new.signed.version != old.signed.version + 1:
            raise Refused(422, f"the list of updates must have version {old.signed.version + 1}")
        if new.signed.is_expired(instant(self.clock())):
            raise Refused(422, "the list of updates has expired")
        added = set(new.signed.targets) - set(old.signed.targets)
        kept = all(new.signed.targets.get(n) == t for n, t in old.signed.targets.items())
        if added != {name} or not kept:
            raise Refused(422, "the list of updates must keep all there are and add this one")
        try:
            new.signed.targets[name].verify_length_and_hashes(content)
        except RepositoryError as error:
            raise Refused(
                422, f"the payload is not the one that was signed: {on_a_line(error)}"
            ) from error
        digest = new.signed.targets[name].hashes["sha256"]
        write_bytes(self.folder / "targets" / f"{digest}.{name}", content)
        self._publish(targets)

    def metadata(self, name: str) -> bytes:
        """Returns a file of metadata; Refused (404). The timestamp is signed anew after RENEW_S s."""
        if name == "timestamp.json" and self._age() > RENEW_S:
            self._stamp()
        return self._read("metadata", name)

    def payload(self, name: str) -> bytes:
        """Returns the content of `<digest>.<name>`; Refused (404) where there is none."""
        return self._read("targets", name)

    def content(self, name: str) -> bytes:
        """Returns the payload of that name in the current list; Refused (404) where it names none."""
        current: Metadata[Targets] = Metadata.from_bytes(self.targets())
        if name not in current.signed.targets:
            raise absent()
        return self.payload(f"{current.signed.targets[name].hashes['sha256']}.{name}")

    def _publish(self, targets: bytes) -> None:
        """Writes the list of updates, with a new snapshot and timestamp for it."""
        listed: Metadata[Targets] = Metadata.from_bytes(targets)
        self._write(f"{listed.signed.version}.targets.json", targets)
        version = listed.signed.version
        snapshot = Metadata(
            Snapshot(
                version=version,
                expires=instant(self.clock()) + SNAPSHOT_VALID,
                meta={"targets.json": MetaFile(version)},
            )
        )
        self._sign(snapshot, f"{version}.snapshot.json")
        self._stamp(version)

    def _stamp(self, version: int | None = None) -> None:
        """Signs and writes the timestamp anew, and a snapshot that expires within two days.

        version: of the snapshot; None: the one that is served.
        """
        now, old = self.clock(), self._read_timestamp()
        version = version or (old.signed.snapshot_meta.version if old else 1)
        path = self.folder / "metadata" / f"{version}.snapshot.json"
        snapshot: Metadata[Snapshot] = Metadata.from_bytes(path.read_bytes())
        if snapshot.signed.expires < instant(now) + 2 * TIMESTAMP_VALID:
            version += 1
            snapshot.signed.version = version
            snapshot.signed.expires = instant(now) + SNAPSHOT_VALID
            self._sign(Metadata(snapshot.signed), f"{version}.snapshot.json")
        stamp = Timestamp(
            version=1 + (old.signed.version if old else 0),
            expires=instant(now) + TIMESTAMP_VALID,
            snapshot_meta=MetaFile(version),
            unrecognized_fields={SIGNED_AT: int(now)},
        )
        self._sign(Metadata(stamp), "timestamp.json")

    def _sign(self, metadata: Metadata[Any], name: str) -> None:
        """Signs metadata by the online key and writes them under the name."""
        metadata.sign(load_key(self._online))
        self._write(name, metadata.to_bytes())

    def _read_timestamp(self) -> Metadata[Timestamp] | None:
        """Returns the timestamp that is served now; None before the first."""
        path = self.folder / "metadata" / "timestamp.json"
        return Metadata.from_bytes(path.read_bytes()) if path.exists() else None

    def _age(self) -> float:
        """Returns the age of the served timestamp in s; 0 where there is none."""
        stamp = self._read_timestamp()
        signed = stamp.signed.unrecognized_fields[SIGNED_AT] if stamp else self.clock()
        return self.clock() - float(signed)

    def _version(self, role: str, of: str) -> int:
        """Returns the version of `of` in the served snapshot; `role` names the metadata to read."""
        stamp = self._read_timestamp()
        if stamp is None:
            raise absent()
        name = f"{stamp.signed.snapshot_meta.version}.{role}.json"
        snapshot: Metadata[Snapshot] = Metadata.from_bytes(self._read("metadata", name))
        return snapshot.signed.meta[of].version

    def _root(self) -> Metadata[Root]:
        """Returns the newest root metadata; raises FileError where there are none."""
        names = (self.folder / "metadata").glob("*.root.json")
        newest = max(names, key=lambda path: int(path.name.split(".")[0]), default=None)
        if newest is None:
            raise FileError(f"{self.folder} was not begun: `skidpad fleet keys` begins it")
        return Metadata.from_bytes(newest.read_bytes())

    def _write(self, name: str, content: bytes) -> None:
        """Writes a file of the metadata whole or not at all."""
        write_bytes(self.folder / "metadata" / name, content)

    def _read(self, part: str, name: str) -> bytes:
        """Returns the bytes of a file in `part`; Refused (404) for an absent file or a name with a path."""
        if not name.replace("-", "").replace(".", "").isalnum() or ".." in name:
            raise absent()
        try:
            return (self.folder / part / name).read_bytes()
        except OSError:
            raise absent() from None
