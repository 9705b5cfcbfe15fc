"""YAML as other programs write calibrations: plain tables, no aliases, no depth."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from freeswing.cdpr.files.documents import InputError, read_text

MOST_BYTES = 1 << 24
MOST_DEEP = 20
OPENCV_MATRIX = "tag:yaml.org,2002:opencv-matrix"


def load_yaml(path: Path) -> dict[str, Any]:
    """The document's table; OpenCV's first line and its tag for matrices are understood.

    Raises:
        InputError: not YAML, not a table, nested without end, or with aliases: a small file of
            aliases to aliases can stand for more numbers than any memory holds.
    """
    import yaml

    class Loader(yaml.SafeLoader):
        """Takes `!!opencv-matrix` for the table that it is."""

        def matrix(self, node: yaml.Node) -> dict[Any, Any]:
            if not isinstance(node, yaml.MappingNode):
                raise yaml.YAMLError("a matrix that is no table")
            return self.construct_mapping(node, deep=True)

    Loader.add_constructor(OPENCV_MATRIX, Loader.matrix)
    text = read_text(path, MOST_BYTES).replace("%YAML:1.0", "%YAML 1.1", 1)
    try:
        depth = 0
        for event in yaml.parse(text, Loader=Loader):
            where = f"{path}: line {event.start_mark.line + 1}"
            if isinstance(event, yaml.AliasEvent):
                raise InputError(f"{where}: an alias (*{event.anchor}) is not read")
            depth += isinstance(event, yaml.CollectionStartEvent)
            depth -= isinstance(event, yaml.CollectionEndEvent)
            if depth > MOST_DEEP:
                raise InputError(f"{where}: tables nested more than {MOST_DEEP} deep")
        document = yaml.load(text, Loader=Loader)
    except (yaml.YAMLError, RecursionError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{path}: not yaml: {str(error)[:200]}") from error
    if not isinstance(document, dict):
        raise InputError(f"{path}: holds no table")
    return document
