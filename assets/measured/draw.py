#!/usr/bin/env python3
"""Draws the tables of measured results in Markdown pages from their files.

    python3 assets/measured/draw.py PAGE.md...            draws the tables anew
    python3 assets/measured/draw.py --check PAGE.md...    changes nothing: 1 when a page differs

A result file is CSV whose first lines say where the numbers come from (# title, # command, which may
repeat, # build, # machine, # date; "not recorded" where nobody knows). A page shows the table NAME.csv
between the lines "<!-- measured NAME -->" and "<!-- end measured -->", but not in fenced code.
Malformed files and pages end it with 2 and a line that says where.
"""

import argparse
import csv
import io
import pathlib
import re
import sys

BEGIN = re.compile(r"<!-- measured (.*) -->")
END = "<!-- end measured -->"
KEYS = ("title", "command", "build", "machine", "date")
UNKNOWN = "not recorded"


class Malformed(Exception):
    """A file or page, its line and what is wrong there."""

    def __init__(self, path, line, problem):
        super().__init__(f"{path}:{line}: {problem}")


def markdown_row(cells):
    escaped = (cell.replace("|", "\\|").replace("\n", " ") for cell in cells)
    return "|" + "".join(f" {cell} |" if cell else " |" for cell in escaped)


def code_span(text):
    return f"`{text}`" if "`" not in text else f"`` {text} ``"


def read_origin(text, path):
    """What the first lines of a result file say of it, each key's values, and how many these lines are."""
    lines = text.splitlines()
    origin = {key: [] for key in KEYS}
    head = 0
    while head < len(lines) and lines[head].startswith("#"):
        match = re.fullmatch(r"# (.+?): (.+)", lines[head])
        if not match:
            raise Malformed(path, head + 1, 'must be "# key: value"')
        key, value = match.groups()
        if key not in KEYS:
            raise Malformed(path, head + 1, f"unknown key {key}; there are {', '.join(KEYS)}")
        if origin[key] and key != "command":
            raise Malformed(path, head + 1, f"{key} is given twice")
        origin[key].append(value)
        head += 1
    for key in KEYS:
        if not origin[key]:
            raise Malformed(path, head + 1,
                            f'no "# {key}: ..." before the table ("{UNKNOWN}" where nobody knows)')
    return origin, head


def read_table(text, path):
    """The Markdown lines of a result file."""
    lines = text.splitlines()
    origin, head = read_origin(text, path)
    rows = csv.reader(io.StringIO("\n".join(lines[head:])), strict=True)
    drawn = []
    try:
        for cells in rows:
            if not cells or (drawn and len(cells) != columns):
                raise Malformed(path, head + rows.line_num,
                                f"{len(cells)} cells under {columns} columns" if drawn else "no columns")
            if not drawn:
                columns = len(cells)
                drawn = [markdown_row(cells), "|" + "---|" * columns]
            else:
                drawn.append(markdown_row(cells))
    except csv.Error as error:
        raise Malformed(path, head + rows.line_num, error) from error
    if len(drawn) < 3:
        raise Malformed(path, len(lines), "no rows under the columns' names")
    commands = " ".join("Command: not recorded." if c == UNKNOWN else code_span(c) + "."
                        for c in origin["command"])
    build, machine, date = (origin[key][0] for key in ("build", "machine", "date"))
    return drawn + ["", f"{origin['title'][0]}. {commands} Build: {build}; machine: {machine}; date: {date}."]


def load_tables(folder):
    tables = {}
    for path in sorted(pathlib.Path(folder).glob("*.csv")):
        tables[path.stem] = read_table(path.read_text(encoding="utf-8"), path)
    return tables


def draw_page(text, path, tables):
    """The page with its tables drawn anew, every other byte as it was, and the names of the tables."""
    drawn, shown = [], []
    fenced, opened = False, None
    for number, line in enumerate(text.splitlines(keepends=True), 1):
        bare = line.rstrip("\r\n")
        if bare.startswith("```") and opened is None:
            fenced = not fenced
        begin = None if fenced else BEGIN.fullmatch(bare)
        if begin:
            if opened is not None:
                break
            if begin[1] not in tables:
                raise Malformed(path, number, f"no result file {begin[1]}.csv")
            opened = number
            shown.append(begin[1])
            drawn.append(line)
            drawn += [row + line[len(bare):] for row in tables[begin[1]]]
        elif bare == END and not fenced:
            if opened is None:
                raise Malformed(path, number, END + " without a beginning")
            opened = None
        if opened is None:
            drawn.append(line)
    if opened is not None:
        raise Malformed(path, opened, f"table {shown[-1]} has no {END} of its own")
    return "".join(drawn), shown


def first_difference(text, drawn, path):
    on_page, in_file = text.splitlines(), drawn.splitlines()
    for number in range(max(len(on_page), len(in_file))):
        pair = [lines[number] if number < len(lines) else "(nothing)" for lines in (on_page, in_file)]
        if pair[0] != pair[1]:
            return f"{path}:{number + 1}: differs from its file\n  page: {pair[0]}\n  file: {pair[1]}"
    return f"{path}: line ends differ"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--check", action="store_true", help="change nothing: exit code 1 when a page differs")
    parser.add_argument("--tables", default=pathlib.Path(__file__).parent, help="folder of the result files")
    parser.add_argument("pages", nargs="+", metavar="PAGE.md")
    arguments = parser.parse_args()
    differs = False
    try:
        tables = load_tables(arguments.tables)
        for page in map(pathlib.Path, arguments.pages):
            text = page.read_bytes().decode("utf-8")
            drawn, _ = draw_page(text, page, tables)
            if drawn == text:
                continue
            differs = True
            if arguments.check:
                print(first_difference(text, drawn, page))
            else:
                page.write_bytes(drawn.encode("utf-8"))
                print(f"{page}: drawn anew")
    except (Malformed, OSError, UnicodeDecodeError) as error:
        print(error, file=sys.stderr)
        return 2
    return int(differs and arguments.check)


if __name__ == "__main__":
    sys.exit(main())
