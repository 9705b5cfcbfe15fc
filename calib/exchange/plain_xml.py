"""OpenCV's FileStorage in xml: tables of numbers, texts and matrices."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

from freeswing.cdpr.files.documents import InputError, read_text

_MOST_BYTES = 1 << 24


def load_opencv_xml(path: Path) -> dict[str, Any]:
    """The document's table; a matrix is a table of rows, cols and data.

    Raises:
        InputError: not xml, of another program, or with a document type of its own.
    """
    text = read_text(path, _MOST_BYTES)
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise InputError(f"{path}: xml with a document type of its own is not read")
    try:
        root = ElementTree.fromstring(text.lstrip())
    except ElementTree.ParseError as error:
        raise InputError(f"{path}: not xml: {error}") from error
    if root.tag != "opencv_storage":
        raise InputError(f"{path}: its root is {root.tag}, OpenCV's is opencv_storage")
    return {child.tag: _value(child) for child in root}


def _value(node: ElementTree.Element) -> Any:
    """A matrix' numbers, a list, a table, or the text."""
    if node.get("type_id") == "opencv-matrix":
        table = {child.tag: (child.text or "").split() for child in node}
        rows, columns = (table.get(key, ["0"])[0] for key in ("rows", "cols"))
        return {"rows": rows, "cols": columns, "data": [float(v) for v in table.get("data", [])]}
    if len(node) and all(child.tag == "_" for child in node):
        return [_value(child) for child in node]
    if len(node):
        return {child.tag: _value(child) for child in node}
    return (node.text or "").strip().strip('"')
