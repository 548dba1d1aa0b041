"""Sizes of the sources in sim, vision, control and experiments: no function over 80 lines, no file over 500, no module of
the page's scripts that no other imports. `sizes_test.py --list` prints the longest instead.

C++ and JavaScript are read by their layout, which clang-format and prettier keep: a block's last line begins with its
brace, indented as the block's first line is, and whatever is between is indented more. A function's lines are those
from its signature to that brace; a function within another counts for both.
"""

import ast
import pathlib
import re
import sys
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
FOLDERS = ('sim', 'vision', 'control', 'experiments')
SUFFIXES = ('.cc', '.h', '.js', '.css', '.py', '.glsl')
MOST_LINES_OF_FUNCTION = 80
MOST_LINES_OF_FILE = 500

RAW_TEXT = re.compile(r'R"(\w*)\(.*?\)\1"', re.S)
OPENING, CLOSING = ('{', '(', '['), ('}', ')', ']')
# `f(x) {`, `f() const {`, `[](int x) -> T {`, `a(b), c(d) {`, `x => {`, `x => h(`; not `x = f({`, `x = {`, `return {`.
FUNCTION = re.compile(r'(?<![({\[,=])(?<!return) \{$|=> [\w.]*[({\[]+$')
NO_FUNCTION = re.compile(
    r'(\} |export |default )*(namespace|class|struct|union|enum|extern|if|else|for|while|do|switch|try|catch|finally)\b')


def indent_of(line):
    return len(line) - len(line.lstrip(' '))


def blocks(lines):
    """(first line, opening line, last line) of every block; the opening line ends with its bracket."""
    for last, line in enumerate(lines):
        if not line.lstrip(' ').startswith(CLOSING):
            continue
        indent, first = indent_of(line), last - 1
        while first >= 0 and (not lines[first].strip() or lines[first].startswith('#') or
                              indent_of(lines[first]) > indent or
                              lines[first].strip().startswith((')', '} = {'))):
            first -= 1
        opening = max(first, 0)
        # C++ ends a signature deeper than it begins, JavaScript where it begins.
        same = [i for i in range(opening, last) if indent_of(lines[i]) == indent and lines[i].endswith(OPENING)]
        while not same and opening < last and not lines[opening].endswith(OPENING):
            opening += 1
        yield first, same[-1] if same else opening, last


def functions_by_layout(text):
    """(signature, first line, lines) of every function in C++ or JavaScript."""
    lines = RAW_TEXT.sub(lambda match: '""' + '\n' * match.group(0).count('\n'), text).split('\n')
    for first, opening, last in blocks(lines):
        signature = ' '.join(line.strip() for line in lines[max(first, 0):opening + 1])
        if '(' in signature and FUNCTION.search(signature) and not NO_FUNCTION.match(signature):
            yield signature, first + 1, last - first + 1


def functions_of(path):
    text = path.read_text()
    if path.suffix == '.py':
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
                yield node.name, node.lineno, node.end_lineno - node.lineno + 1
    elif path.suffix != '.css':
        yield from functions_by_layout(text)


def sources():
    return sorted(path for folder in FOLDERS for path in (ROOT / folder).rglob('*') if path.suffix in SUFFIXES)


def main():
    found = [(n, f'{p.relative_to(ROOT)}:{line}', name) for p in sources() for name, line, n in functions_of(p)]
    for n, where, name in sorted(found, reverse=True):
        print(f'{n:5} {where:60} {name[:90]}')


if __name__ == '__main__':
    main()
