"""Registries of what Skidpad and installed packages add: sensors, weather presets, relays, ...

A package adds an entry by an entry point in its metadata (docs/extending.md). Metadata are read
when a registry is first looked into, and code of a package only when its entry is needed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, partial
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from typing import Generic, Protocol, TypeVar

from skidpad.core.errors import ConfigError, describe_unknown
from skidpad.core.text.told import describe_value

T = TypeVar("T")


def load_factory(factory: Callable[..., T] | str) -> Callable[..., T]:
    """Returns a factory as it is, or imports the one that a text "module:function" names."""
    if not isinstance(factory, str):
        return factory
    module, _, name = factory.partition(":")
    found: Callable[..., T] = getattr(import_module(module), name)
    return found


class Entry(Protocol):
    """What every entry of a registry says of itself."""

    @property
    def name(self) -> str:
        """Returns the name by which users ask for it."""

    @property
    def title(self) -> str:
        """Returns a few words for tables and pages."""


E = TypeVar("E", bound=Entry)


@dataclass(frozen=True, slots=True)
class Source(Generic[E]):
    """One name of a registry, and where its entry comes from."""

    name: str
    package: str  # "skidpad", or the distribution that installed it
    load: Callable[[], E]


def _as_is(entry: E) -> E:
    """Returns the entry itself, as the loader of entries that need no loading."""
    return entry


class Registry(Generic[E]):
    """Entries of one kind by name: those of Skidpad, then those of installed packages.

    Attributes:
        noun: What an entry is, in the singular, for messages.
        group: The entry-point group by which packages add entries.
        kind: The class of an entry.
    """

    def __init__(
        self, noun: str, group: str, kind: type[E], own: Callable[[], tuple[E, ...]]
    ) -> None:
        """own: returns Skidpad's entries, in the order in which they are shown."""
        self.noun, self.group, self.kind, self._own = noun, group, kind, own
        self._sources: dict[str, Source[E]] | None = None

    def sources(self) -> Mapping[str, Source[E]]:
        """Returns all names with their sources; ConfigError where two packages use one name."""
        if self._sources is None:
            found = {e.name: Source(e.name, "skidpad", partial(_as_is, e)) for e in self._own()}
            for point in sorted(entry_points(group=self.group), key=lambda p: p.name):
                package = "?" if point.dist is None else point.dist.name
                if point.name in found:
                    raise ConfigError(
                        f"{self.noun} {point.name!r} of the package {package} has the name of one of "
                        f"{found[point.name].package}: rename it, or remove the package"
                    )
                found[point.name] = Source(point.name, package, cache(self._loader(point, package)))
            self._sources = found
        return self._sources

    def names(self) -> tuple[str, ...]:
        """Returns all names, Skidpad's own first."""
        return tuple(self.sources())

    def get(self, name: str) -> E:
        """Returns the entry; for an unknown name ConfigError lists those that exist, and the nearest."""
        source = self.sources().get(name)
        if source is None:
            raise ConfigError(describe_unknown(self.noun, name, self.names()))
        return source.load()

    def entries(self) -> tuple[E, ...]:
        """Returns all entries, which loads every package that adds one."""
        return tuple(source.load() for source in self.sources().values())

    def foreign_entries(self) -> tuple[E, ...]:
        """Returns the entries of other packages; ConfigError for one that cannot be loaded."""
        return tuple(s.load() for s in self.sources().values() if s.package != "skidpad")

    def _loader(self, point: EntryPoint, package: str) -> Callable[[], E]:
        """Returns the function that loads an entry of another package and checks its type and name."""

        def load() -> E:
            where = f"{self.noun} {point.name!r} of the package {package}"
            try:
                entry = point.load()
            except Exception as error:  # an import runs code of the package: anything can happen
                raise ConfigError(
                    f"{where} cannot be loaded: {describe_value(error)}; mend or remove the package"
                ) from error
            if not isinstance(entry, self.kind):
                raise ConfigError(
                    f"{where}: {point.value} must be a {self.kind.__name__}, "
                    f"got {describe_value(entry, 100)}"
                )
            if entry.name != point.name:
                raise ConfigError(
                    f"{where} calls itself {entry.name!r}: both names must be the same"
                )
            return entry

        return load
