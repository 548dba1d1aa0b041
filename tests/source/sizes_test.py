"""Sizes of the sources: no function over 80 lines and no file over 500 in sim, vision, control and experiments; of the
page's scripts no module and no export that nothing imports. `sizes_test.py --list` prints every function, longest first.

C++ and JavaScript are read by their layout, which clang-format and prettier keep: a block's last line begins with its
closing bracket, indented as the block's first line is, and whatever is between is indented more. A function's lines are
those from its signature to that bracket; a function within another counts for both.
"""

import ast
import pathlib
import re
import sys
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
FOLDERS = ('sim', 'vision', 'control', 'experiments')
SUFFIXES = ('.cc', '.h', '.js', '.css', '.py', '.pyi')
MOST_LINES_OF_FUNCTION = 80
MOST_LINES_OF_FILE = 500

RAW_TEXT = re.compile(r'R"(\w*)\(.*?\)\1"[^\n]*', re.S)  # and what ends its line
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
        first = max(first, 0)
        # C++ ends a signature deeper than it begins, JavaScript where it begins.
        opening = [i for i in range(first, last) if lines[i].endswith(OPENING) and indent_of(lines[i]) == indent]
        deeper = [i for i in range(first, last) if lines[i].endswith(OPENING)]
        if deeper:
            yield first, opening[-1] if opening else deeper[0], last


def functions_by_layout(text):
    """(signature, first line, lines) of every function in C++ or JavaScript."""
    lines = RAW_TEXT.sub(lambda match: '""' + '\n' * match.group(0).count('\n'), text).split('\n')
    for first, opening, last in blocks(lines):
        signature = ' '.join(line.strip() for line in lines[first:opening + 1])
        if '(' in signature and FUNCTION.search(signature) and not NO_FUNCTION.match(signature):
            yield signature, first + 1, last - first + 1


def functions_of(path):
    text = path.read_text()
    if path.suffix in ('.py', '.pyi'):
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
                yield node.name, node.lineno, node.end_lineno - node.lineno + 1
    elif path.suffix != '.css':
        yield from functions_by_layout(text)


def sources():
    return sorted(path for folder in FOLDERS for path in (ROOT / folder).rglob('*')
                  if path.suffix in SUFFIXES and 'node_modules' not in path.parts)


def functions():
    """(lines, where, signature) of all."""
    return [(lines, f'{path.relative_to(ROOT)}:{first}', name) for path in sources()
            for name, first, lines in functions_of(path)]


def dead_scripts(scripts):
    """What no module imports: of {name: text} modules and exports. `main` is where they begin."""
    text = '\n'.join(scripts.values())
    imported = {name for names in re.findall(r'import \{([^}]*)\}', text) for name in re.findall(r'\w+', names)}
    for name, script in scripts.items():
        if f'page/{name}.js' not in text and name != 'main':
            yield f'{name}.js'
        for export in re.findall(r'^export (?:async )?(?:function|class|const|let) (\w+)', script, re.M):
            if export not in imported and export != 'show':
                yield f'{name}.js: {export}'


class Sizes(unittest.TestCase):
    def test_no_function_is_longer_than_a_screen(self):
        self.assertEqual([f for f in functions() if f[0] > MOST_LINES_OF_FUNCTION], [])

    def test_no_file_is_longer_than_a_chapter(self):
        lines = {str(path.relative_to(ROOT)): len(path.read_text().splitlines()) for path in sources()}
        self.assertEqual({path: n for path, n in lines.items() if n > MOST_LINES_OF_FILE}, {})

    def test_every_script_of_the_page_is_used(self):
        page = ROOT / 'experiments/page'
        scripts = {path.stem: path.read_text() for path in (page / 'web').glob('*.js')}
        self.assertEqual(list(dead_scripts(scripts)), [])


class Reading(unittest.TestCase):
    def measured(self, text):
        return {name.split('(')[0].split()[-1]: lines for name, _, lines in functions_by_layout(text)}

    def test_cxx(self):
        self.assertEqual(self.measured('\n'.join([
            'namespace a {', 'int Long(int x,', '         int y) {', '  if (x) {', '    y();', '  }', '',
            '  const char* shader = R"(', 'void main() {', '}', ')";', '  return x;', '}',
            'struct S {', '  int Inside() const {', '    return 1;', '  }', '};',
            'S::S(int x)', '    : a_(x),', '      b_{x} {', '  f();', '}',
            'const T kTable[] = {', '    f(1),', '};', '}  // namespace a'])),
            {'Long': 12, 'Inside': 3, 'S::S': 5})

    def test_javascript(self):
        self.assertEqual(self.measured('\n'.join([
            'export function long(', '  a,', '  {b} = {},', ') {', '  const x = f({', '    y: 1,', '  });',
            '  return x;', '}', 'class C {', '  method(a) {', '    return a;', '  }', '}',
            'const arrow = (a) => {', '  return a;', '};'])),
            {'long': 9, 'method': 3, '=': 3})

    def test_scripts(self):
        scripts = {'main': "import {used} from 'page/parts.js';", 'parts': 'export function used() {\nexport const lost = 1;',
                   'gone': ''}
        self.assertEqual(list(dead_scripts(scripts)), ['parts.js: lost', 'gone.js'])


if __name__ == '__main__':
    if '--list' in sys.argv:
        for lines, where, name in sorted(functions(), reverse=True):
            print(f'{lines:5} {where:60} {name[:90]}')
    else:
        unittest.main()
