"""Result documents to and from JSON: one rule for all of them.

A document is a frozen dataclass of keyword fields in the order in which they are written. A field
made with `absent` is left out where it has its default; every other one is written always, and
read with its default where a smaller document lacks it. Keys that no field names are kept in
`further` and written again, so that what another version adds is not lost on the way.
"""

from __future__ import annotations

import dataclasses
import types
from collections.abc import Callable, Mapping
from functools import cache
from typing import (
    Any,
    ClassVar,
    Self,
    TypeVar,
    dataclass_transform,
    get_args,
    get_origin,
    get_type_hints,
)

from freeswing.cdpr.files.documents import plain_json

T = TypeVar("T")
Numbers = tuple[float | None, ...]
Table = Mapping[str, Any]
_SHOWN = 40  # characters of a wrong value that a message repeats


def absent(default: Any = None) -> Any:
    """A field that is written only where it differs from `default`."""
    return dataclasses.field(default=default, metadata={"absent": True})


def empty(*, default_factory: Callable[[], Any] = dict) -> Any:
    """A mapping that is written always and read as empty where it is not there.

    Type checkers see a default only where the call names its factory.
    """
    return dataclasses.field(default_factory=default_factory)


@dataclass_transform(
    kw_only_default=True, frozen_default=True, field_specifiers=(absent, empty, dataclasses.field)
)
def entry(cls: type[T]) -> type[T]:
    """Decorator of every document and of every table in one."""
    return dataclasses.dataclass(frozen=True, slots=True, kw_only=True)(cls)


@entry
class Entry:
    """A table of a document.

    Attributes:
        further: keys that this version does not name, as they were read.
    """

    further: Table = empty(default_factory=dict)

    @classmethod
    def from_json(cls, table: Table) -> Self:
        """Read a table of plain JSON values (arrays are taken too).

        Raises:
            ValueError: naming the key whose value is not what its field says.
        """
        return _reader(cls)(plain_json(table), "")

    def to_json(self) -> dict[str, Any]:
        """The table as it is written."""
        table: dict[str, Any] = {}
        for field in _fields(type(self)):
            value = getattr(self, field.name)
            if not field.metadata.get("absent") or value != field.default:
                table[field.name] = _plain(value)
        return {**table, **self.further}


@entry
class Provenance(Entry):
    """What a result was made of, see `session.provenance`; what was not kept is None.

    Attributes:
        made: when; files of this version do not say.
        seconds: that it took; likewise.
        versions: of this program, Python and packages, by name.
        settings: the flags that change the result.
        inputs: SHA-256 of each input, by its name in the session.
        outputs: likewise of the files written beside.
    """

    made: str | None = absent()
    seconds: float | None = absent()
    versions: Table | None = absent()
    settings: Table | None = absent()
    inputs: Table | None = absent()
    outputs: Table | None = absent()

    @property
    def is_kept(self) -> bool:
        """Whether anything is known."""
        return bool(self.to_json())


@entry
class Document(Entry):
    """A result file; `kind` and `version` make its first line, `freeswing-<kind>/<version>`.

    Attributes:
        provenance: what it was made of.
    """

    kind: ClassVar[str] = ""
    version: ClassVar[int] = 1

    provenance: Provenance = empty(default_factory=lambda: Provenance.from_json({}))

    @classmethod
    def format(cls) -> str:
        """What the file's `format` key must say."""
        return f"freeswing-{cls.kind}/{cls.version}"

    @classmethod
    def from_json(cls, table: Table) -> Self:
        """See `Entry.from_json`; the `format` key must be this document's.

        Raises:
            ValueError: naming what is wrong.
        """
        if not isinstance(table, Mapping) or table.get("format") != cls.format():
            raise ValueError(f"its format is not {cls.format()}")
        plain = {key: value for key, value in table.items() if key != "format"}
        return _reader(cls)(plain_json(plain), "")

    def to_json(self) -> dict[str, Any]:
        """The whole file: format first, provenance last."""
        # No bare super(): a dataclass with slots is another class than the one written here.
        body = Entry.to_json(self)
        made = self.provenance.to_json()
        return {"format": self.format(), **body, **({"provenance": made} if made else {})}

    def made_of(self, provenance: Table) -> Self:
        """The same document with its provenance."""
        return dataclasses.replace(self, provenance=Provenance.from_json(provenance))


Read = Callable[[Any, str], Any]


@cache
def _fields(cls: type[Entry]) -> tuple[Any, ...]:
    """Fields in the order of writing; `further` and `provenance` have places of their own."""
    own = dataclasses.fields(cls)
    return tuple(field for field in own if field.name not in ("further", "provenance"))


@cache
def _reader(hint: Any) -> Read:
    """What reads a value of a type: the value and where it stands, in; the typed value, out."""
    if isinstance(hint, type) and issubclass(hint, Entry):
        return _table_reader(hint)
    origin, arguments = get_origin(hint), get_args(hint)
    if origin in (types.UnionType,):
        return _optional_reader(_reader(next(a for a in arguments if a is not types.NoneType)))
    if origin is tuple:
        return _list_reader(_reader(arguments[0]))
    if origin is not None and issubclass(origin, Mapping):
        return _mapping_reader(_reader(arguments[1]))
    return _PLAIN[hint]


def _table_reader(cls: type[Entry]) -> Read:
    hints = get_type_hints(cls)
    readers: dict[str, Read] = {}

    def read(value: Any, where: str) -> Entry:
        if not isinstance(value, dict):
            raise _wrong(value, where, "a table")
        if not readers:  # a table may hold tables of its own kind
            names = [field.name for field in dataclasses.fields(cls) if field.name != "further"]
            readers.update({name: _reader(hints[name]) for name in names})
        known = {
            key: readers[key](one, f"{where}.{key}" if where else key)
            for key, one in value.items()
            if key in readers
        }
        further = {key: one for key, one in value.items() if key not in readers}
        missing = [
            field.name
            for field in dataclasses.fields(cls)
            if field.name not in known
            and field.default is dataclasses.MISSING
            and field.default_factory is dataclasses.MISSING
        ]
        if missing:
            raise ValueError(f"{where or 'it'} lacks {', '.join(missing)}")
        return cls(**known, further=further)

    return read


def _optional_reader(inner: Read) -> Read:
    return lambda value, where: None if value is None else inner(value, where)


def _list_reader(inner: Read) -> Read:
    def read(value: Any, where: str) -> tuple[Any, ...]:
        if not isinstance(value, list):
            raise _wrong(value, where, "a list")
        return tuple(inner(one, f"{where}[{k}]") for k, one in enumerate(value))

    return read


def _mapping_reader(inner: Read) -> Read:
    def read(value: Any, where: str) -> dict[str, Any]:
        if not isinstance(value, dict):
            raise _wrong(value, where, "a table")
        return {key: inner(one, f"{where}.{key}") for key, one in value.items()}

    return read


def _plain_reader(kinds: tuple[type, ...], what: str) -> Read:
    def read(value: Any, where: str) -> Any:
        if not isinstance(value, kinds) or (isinstance(value, bool) and bool not in kinds):
            raise _wrong(value, where, what)
        return value

    return read


def _wrong(value: Any, where: str, what: str) -> ValueError:
    return ValueError(f"{where or 'it'} is {str(value)[:_SHOWN]!r}, not {what}")


def _plain(value: Any) -> Any:
    if isinstance(value, Entry):
        return value.to_json()
    if isinstance(value, tuple):
        return [_plain(one) for one in value]
    if isinstance(value, Mapping):
        return {key: _plain(one) for key, one in value.items()}
    return value


_PLAIN: dict[Any, Read] = {
    Any: lambda value, where: value,
    float: _plain_reader((int, float), "a number"),
    int: _plain_reader((int,), "a whole number"),
    str: _plain_reader((str,), "a text"),
    bool: _plain_reader((bool,), "true or false"),
}
