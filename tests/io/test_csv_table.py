"""Test that spreadsheets read texts of CSV files as texts, and that one writer makes all files."""

from __future__ import annotations

import ast
import csv
import re
import tomllib
from io import StringIO
from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from ccwsim.io.formats.csv_table import FORMULA, csv_as_bytes

PACKAGE = Path(__file__).parents[2] / "ccwsim"
WRITER = PACKAGE / "io" / "formats" / "csv_table.py"
IN_BROWSER = PACKAGE / "ui" / "frontend" / "chart_menu" / "chart_menu.js"
HOSTILE = ("=1+1", "+1+1", "-1+1", "@SUM(1)", "\t=1", "\r=1", "\n=1", '=HYPERLINK("//e.vil", "x")')
WIDE = tuple(f"{sign}1+1" for sign in "＝＋－＠")
DIVIDED = {"a;=1+1": "a;'=1+1", ";=1": ";'=1", "a\t=1+1": "a\t'=1+1", "a;b\t-c;1": "a;b\t'-c;1"}
NUMBERS = ("-3.5", "+2", "1e-7", "-inf", "nan", "-0")


def rows(content: bytes) -> list[list[str]]:
    return list(csv.reader(StringIO(content.decode(), newline="")))


@pytest.mark.parametrize("text", HOSTILE + WIDE)
def test_a_text_is_no_formula(text):
    assert rows(csv_as_bytes([text], [[text, 1]])) == [[f"'{text}"], [f"'{text}", "1"]]


@pytest.mark.parametrize(("text", "safe"), DIVIDED.items())
def test_a_text_is_no_formula_in_a_spreadsheet_with_other_separators(text, safe):
    assert rows(csv_as_bytes([text], [])) == [[safe]]


def test_the_browser_has_the_same_rule():
    assert f"const FORMULA = /{FORMULA.pattern}/g;" in IN_BROWSER.read_text("utf-8")


def test_a_number_stays_a_number():
    values = [*NUMBERS, *map(float, NUMBERS), -3, True, None]
    assert rows(csv_as_bytes([], [values]))[1] == ["" if v is None else str(v) for v in values]


@given(st.lists(st.text(st.characters(codec="utf-8", exclude_characters="\0")), min_size=1))
def test_any_text_comes_back_with_more_apostrophes_at_most(texts):
    (line,) = rows(csv_as_bytes(texts, []))
    for text, read in zip(texts, line, strict=True):
        assert read.replace("'", "") == text.replace("\r\n", "\n").replace("'", "")
        assert not any(part.startswith(("=", "@")) for part in read.split(";"))


WRITERS = re.compile(r"""csv\.(writer|DictWriter)|to_csv|savetxt|['"](,|;|\\t)['"]\.join""")


def test_no_other_module_writes_csv():
    """Test that no other module joins or writes tables, which could contain formulas."""
    modules = [path for path in PACKAGE.rglob("*.py") if WRITERS.search(path.read_text("utf-8"))]
    assert modules == [WRITER]
    scripts = [path for path in PACKAGE.rglob("*.js") if "csv" in path.read_text("utf-8")]
    assert scripts == [IN_BROWSER]


def test_every_file_for_spreadsheets_comes_from_the_writer():
    """Test that every function named `…_csv` returns the result of the writer."""
    made = []
    for text in [path.read_text("utf-8") for path in PACKAGE.rglob("*.py")]:
        for node in ast.walk(ast.parse(text)) if "_csv(" in text else ():
            if isinstance(node, ast.FunctionDef) and node.name.endswith("_csv"):
                last = node.body[-1]
                assert isinstance(last, ast.Return), node.name
                assert re.match(r"return (csv_as_bytes|records_as_csv)\(", ast.unparse(last)), (
                    node.name
                )
                made.append(node.name)
    assert len(made) >= 8


def test_streamlit_writes_no_table_of_its_own():
    settings = tomllib.loads((PACKAGE.parent / ".streamlit" / "config.toml").read_text("utf-8"))
    assert settings["client"]["disableDataExport"] is True
