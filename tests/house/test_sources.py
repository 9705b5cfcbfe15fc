"""Public functions that compute arrays name the paper and equation, or the book, they are from."""

from __future__ import annotations

import ast
import re

from tests.house.test_house import SOURCES, name_of

# A year, or an equation, section, chapter, table or figure of a work that the module names.
SOURCE = re.compile(
    r"\beqs?\. |\bsec\. |\bch\. |\bchapter\b|\b1[5-9]\d\d\b|\b20[012]\d\b|\bTable \d|\bFig\. \d"
)
ARITHMETIC = re.compile(
    r"np\.(linalg\..*|einsum|sqrt|cos|sin|exp|log|cross|dot|median|mean|var|std|percentile|quantile"
    r"|diff|cumsum|sum|hypot|arctan2)|scipy\..*"
)
PRODUCTS = (ast.Mult, ast.Div, ast.MatMult, ast.Pow)

# These hand on, read or sort what others computed; a product in them counts columns or samples.
NO_FORMULA = {
    "cdpr/files/drive_csv.py:read_static": "reads a table",
    "cdpr/measured/marker_recording.py:marker_position": "picks a column",
    "homing/rest_readings.py:evaluate_evenly": "pads a batch",
    "ident/bench/noise.py:column_residuals": "splits an array",
    "ident/diagnose/declared_model.py:white_noise_scales": "a root mean square of ratios",
    "ident/bench/priors/motion_priors.py:loose_coordinates": "widths by coordinate",
    "ident/drive/second_start.py:away": "numbers five per cent off",
    "servo/design/pid.py:slowest_filters": "a number times modes",
    "vision/fuse/run_views.py:instants_of": "picks time stamps",
}


def computes(function: ast.FunctionDef) -> bool:
    """Whether it multiplies, divides or calls numpy's mathematics."""
    for node in ast.walk(function):
        if isinstance(node, ast.BinOp | ast.AugAssign) and isinstance(node.op, PRODUCTS):
            return True
        if isinstance(node, ast.Call) and ARITHMETIC.fullmatch(ast.unparse(node.func)):
            return True
    return False


def numeric() -> dict[str, str]:
    """Docstrings of the public functions at the top of a module that compute and give arrays."""
    found = {}
    for path in SOURCES:
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if not isinstance(node, ast.FunctionDef) or node.name.startswith("_"):
                continue
            given = ast.unparse(node.returns) if node.returns else ""
            if "Array" in given and computes(node):
                found[f"{name_of(path)}:{node.name}"] = ast.get_docstring(node) or ""
    return found


NUMERIC = numeric()


def test_there_are_numeric_functions() -> None:
    assert len(NUMERIC) > 150, len(NUMERIC)


def test_numeric_functions_name_their_source() -> None:
    silent = [name for name, told in NUMERIC.items() if not SOURCE.search(told)]
    missing = sorted(set(silent) - set(NO_FORMULA))
    assert missing == [], f"{len(missing)} of {len(NUMERIC)} name no paper or book: {missing}"


def test_those_without_a_formula_are_still_there() -> None:
    assert set(NO_FORMULA) <= set(NUMERIC), sorted(set(NO_FORMULA) - set(NUMERIC))
