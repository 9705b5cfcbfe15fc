"""Arrays that the program keeps on disk for itself: read with limits, or taken for absent."""

from __future__ import annotations

import io
import struct
import tokenize
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from zipfile import ZIP_STORED, BadZipFile, ZipFile

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.files.documents import replace_file

Arrays = dict[str, NDArray[Any]]

_DAMAGED = (
    BadZipFile,
    OSError,
    EOFError,
    KeyError,
    ValueError,  # numpy's for what is no array, or one that would have to be unpickled
    TypeError,
    SyntaxError,
    MemoryError,
    OverflowError,
    RuntimeError,  # zipfile's for what is encrypted or packed in a way that it does not know
    struct.error,
    zlib.error,
    tokenize.TokenError,
)


def save_arrays(path: Path, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Write named arrays, unpacked, at `path`, whole or not at all."""
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)  # pyright: ignore[reportArgumentType]
    replace_file(path, buffer.getvalue())


def whole_arrays(path: Path, most_bytes: int) -> Arrays | None:
    """What `save_arrays` wrote; None where that is absent, damaged, packed or larger."""
    try:
        with ZipFile(path) as archive:
            infos = archive.infolist()
            plain = all(info.compress_type == ZIP_STORED for info in infos)
            if not plain or sum(info.file_size for info in infos) > most_bytes:
                return None
            if archive.testzip() is not None:
                return None
        with np.load(path, allow_pickle=False) as data:
            return {name: np.asarray(data[name]) for name in data.files}
    except _DAMAGED:
        return None
