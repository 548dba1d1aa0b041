"""Where faults can be planted: clang's syntax tree of a source file, and the file with faults written into it.

A fault is a list of insertions and replacements at single places of the text, so that faults can lie within one
another; mutation.h has what they call.
"""

import bisect
import dataclasses
import shlex

from clang import cindex
from clang.cindex import CursorKind as Kind
from clang.cindex import TypeKind

HEADER = 'tests/mutation/mutation.h'
REAL = {TypeKind.FLOAT, TypeKind.DOUBLE}
WHOLE = {TypeKind.INT, TypeKind.UINT, TypeKind.LONG, TypeKind.ULONG, TypeKind.LONGLONG, TypeKind.ULONGLONG,
         TypeKind.UCHAR, TypeKind.SHORT, TypeKind.USHORT}
FUNCTIONS = {Kind.FUNCTION_DECL, Kind.CXX_METHOD, Kind.CONSTRUCTOR, Kind.FUNCTION_TEMPLATE}
STATEMENTS = {Kind.CALL_EXPR, Kind.BINARY_OPERATOR, Kind.COMPOUND_ASSIGNMENT_OPERATOR, Kind.UNARY_OPERATOR,
              Kind.UNEXPOSED_EXPR}
ARITHMETIC = {'+': 'Add', '-': 'Subtract', '*': 'Multiply', '/': 'Divide'}
ORDER = {'<': 'Less', '<=': 'LessOrEqual', '>': 'Greater', '>=': 'GreaterOrEqual'}
TURNED = {'<': '>=', '<=': '>', '>': '<=', '>=': '<', '==': '!=', '!=': '==', '+': '-', '-': '+', '*': '/', '/': '*'}
BOUND = {'<': '<=', '<=': '<', '>': '>=', '>=': '>'}
# What a message says, and what only saves time, is no fault of the core.
LEFT_ALONE = ('TD_CHECK', 'throw ', 'fmt::', '.reserve(', 'shrink_to_fit', 'static_assert', 'case ', 'constexpr')


@dataclasses.dataclass
class Edit:
    """Text at [begin, end) of the file becomes `text`, in which # is the fault's number."""
    begin: int
    end: int
    text: str
    of: tuple  # of the expression that it wraps: where that begins and ends
    opens: bool = True


@dataclasses.dataclass
class Fault:
    file: str
    line: int
    kind: str
    was: str
    becomes: str
    edits: list


class Source:
    """One file of the core."""

    def __init__(self, root, file, command):
        self.file = file
        self.text = (root / file).read_bytes()
        words = shlex.split(command)
        arguments = ['-std=c++20', '-Wno-everything']
        for word, after in zip(words, words[1:]):
            if word.startswith(('-I', '-D')):
                arguments.append(word)
            elif word == '-isystem':
                arguments += [word, after]
        self.unit = cindex.Index.create().parse(str(root / file), args=arguments)
        errors = [str(d) for d in self.unit.diagnostics if d.severity >= cindex.Diagnostic.Error]
        if errors:
            raise RuntimeError(f'{file}: {errors[0]}')
        self.faults = []

    def places(self):
        for cursor in self.unit.cursor.get_children():
            if cursor.location.file and cursor.location.file.name.endswith(self.file):
                self.outside(cursor)
        return self.faults

    def outside(self, cursor):
        """Declarations: what is computed is in functions' bodies."""
        if cursor.kind in FUNCTIONS:
            body = [c for c in cursor.get_children() if c.kind == Kind.COMPOUND_STMT]
            head = self.text[cursor.extent.start.offset:body[0].extent.start.offset] if body else b''
            if body and b'constexpr' not in head and b'consteval' not in head:
                self.inside(body[0], None)
            return
        for child in cursor.get_children():
            self.outside(child)

    def inside(self, cursor, parent):
        begin, end = span(cursor)
        if cursor.kind in (Kind.CXX_THROW_EXPR, Kind.CASE_STMT, Kind.ALIGNED_ATTR) or (
                parent and parent.kind == Kind.COMPOUND_STMT and self.alone(begin, end)):
            return
        self.look(cursor, parent, begin, end)
        for child in cursor.get_children():
            self.inside(child, cursor)

    def alone(self, begin, end):
        head = self.text[begin:end].split(b'{')[0].decode()
        return any(word in head for word in LEFT_ALONE)

    def between(self, first, last):
        return self.text[span(first)[1]:span(last)[0]].decode().strip()

    def add(self, cursor, kind, was, becomes, *edits):
        begin, end = span(cursor)
        made = []
        for edit in edits:
            made.append(Edit(*edit[:3], of=(begin, end), opens=len(edit) < 4))
        self.faults.append(Fault(self.file, cursor.extent.start.line, kind, was, becomes, made))

    def wrapped(self, cursor, kind, was, becomes, before, after):
        begin, end = span(cursor)
        self.add(cursor, kind, was, becomes, (begin, begin, before), (end, end, after, 'closes'))

    def look(self, cursor, parent, begin, end):
        if begin >= end:
            return  # of a macro
        children = list(cursor.get_children())
        text = self.text[begin:end].decode()
        if parent and parent.kind == Kind.COMPOUND_STMT and cursor.kind in STATEMENTS:
            self.add(cursor, 'statement', text, 'nothing', (begin, begin, 'if (!mutation::On(#)) '))
        if cursor.kind == Kind.BINARY_OPERATOR and len(children) == 2:
            self.operator(cursor, text, *children)
        elif cursor.kind == Kind.COMPOUND_ASSIGNMENT_OPERATOR and len(children) == 2:
            self.assignment(cursor, text, *children)
        elif cursor.kind == Kind.CALL_EXPR:
            self.call(cursor, text, children)
        elif cursor.kind == Kind.UNARY_OPERATOR and text.startswith('-') and is_a(cursor, REAL):
            self.add(cursor, 'sign', text, text[1:], (begin, begin + 1, '(-mutation::Sign(#)) * '))
        elif cursor.kind == Kind.FLOATING_LITERAL and text.strip('0.f'):
            self.wrapped(cursor, 'constant', text, f'1.1 * {text}', 'mutation::Value(#, ', ')')

    def operator(self, cursor, text, left, right):
        sign = self.between(left, right)
        (a, b), (c, d) = span(left), span(right)
        number = all(is_a(side, REAL | WHOLE) for side in (left, right))
        real = number and any(is_a(side, REAL) for side in (left, right))
        if sign in ('&&', '||'):
            dropped = '(mutation::On(#) || (' if sign == '&&' else '(!mutation::On(#) && ('
            self.add(cursor, 'logic', text, self.text[c:d].decode(), (a, a, dropped), (b, b, '))', 'closes'))
            dropped = dropped.replace('(mutation', 'mutation', 1).replace('(!mutation', '!mutation', 1)
            self.add(cursor, 'logic', text, self.text[a:b].decode(), (c, c, f'({dropped}'), (d, d, '))', 'closes'))
        elif not number:
            return
        elif sign in ARITHMETIC or sign in ORDER:
            if sign in ORDER and real:  # equal numbers hardly come: the bound itself makes no difference
                self.wrapped(cursor, 'order', text, self.said(left, TURNED[sign], right), '(mutation::On(#) != (', '))')
                return
            kind = 'order' if sign in ORDER else 'sign' if sign in '+-' else 'factor'
            name = ORDER[sign] if sign in ORDER else ARITHMETIC[sign]
            becomes = self.said(left, BOUND[sign] if sign in ORDER else TURNED[sign], right)
            at = b + self.text[b:c].index(sign.encode())
            begin, end = span(cursor)
            self.add(cursor, kind, text, becomes, (begin, begin, f'mutation::{name}(#, '), (at, at + len(sign), ','),
                     (end, end, ')', 'closes'))
            for side in (left, right):
                inner = self.text[slice(*span(side))].decode()
                if side.kind == Kind.INTEGER_LITERAL or inner.isdigit():
                    self.wrapped(side, 'constant', text, f'{inner} + 1', 'mutation::Value(#, ', ')')
        elif sign in ('==', '!='):
            self.wrapped(cursor, 'order', text, self.said(left, TURNED[sign], right), '(mutation::On(#) != (', '))')

    def assignment(self, cursor, text, left, right):
        sign = self.between(left, right)
        if sign in ('+=', '-=') and is_a(left, REAL):
            self.signed(right, text, self.said(left, TURNED[sign[0]] + '=', right))

    def signed(self, right, text, becomes):
        self.wrapped(right, 'sign', text, becomes, 'mutation::Sign(#) * (', ')')

    def said(self, left, sign, right):
        return f'{self.text[slice(*span(left))].decode()} {sign} {self.text[slice(*span(right))].decode()}'

    def call(self, cursor, text, children):
        begin, end = span(cursor)
        name = cursor.spelling
        if name in ('operator+', 'operator-', 'operator+=', 'operator-=') and len(children) >= 2:
            left, right = children[0], children[-1]
            sign = name.removeprefix('operator')
            if self.between(left, right) == sign and 'Eigen' in right.type.get_canonical().spelling:
                self.signed(right, text, self.said(left, sign.replace(sign[0], TURNED[sign[0]]), right))
        elif name == 'operator[]' and len(children) >= 2:
            index = children[-1]
            inner = self.text[slice(*span(index))].decode()
            if inner.isdigit():
                self.wrapped(index, 'index', text, f'{text[:text.rindex("[")]}[{1 if inner == "0" else int(inner) - 1}]',
                             'mutation::Index(#, ', ')')
        elif name in ('min', 'max') and text.startswith(f'std::{name}') and not text.startswith(f'std::{name}({{'):
            at = begin + text.index('(') + 1
            other = 'max' if name == 'min' else 'min'
            self.add(cursor, 'bound', text, text.replace(name, other, 1), (begin, begin + 8, f'mutation::{name}'),
                     (at, at, '#, '))
        elif name in ('x', 'y', 'z') and text.endswith(f'.{name}()') and len(children) == 1:
            inner = end - 4
            becomes = {'x': 'y', 'y': 'x', 'z': 'y'}[name]
            self.add(cursor, 'index', text, f'{text[:-3]}{becomes}()', (begin, begin, f'mutation::{name}(#, '),
                     (inner, end, ')', 'closes'))


def span(cursor):
    return cursor.extent.start.offset, cursor.extent.end.offset


def is_a(cursor, kinds):
    return cursor.type.get_canonical().kind in kinds


def written(text, numbered):
    """The file with these faults, each (number, fault), in it."""
    edits = []
    for number, fault in numbered:
        for edit in fault.edits:
            length = edit.of[1] - edit.of[0]
            # Of several at a place: what closes, inner first; then what opens, outer first; then what is replaced.
            place = (edit.begin, 0, length) if edit.begin == edit.end and not edit.opens else (
                edit.begin, 1 if edit.begin == edit.end else 2, -length)
            edits.append((place, number, edit))
    out, at = [], 0
    for _, number, edit in sorted(edits, key=lambda e: (e[0], e[1])):
        out += [text[at:edit.begin], edit.text.replace('#', str(number)).encode()]
        at = max(at, edit.end)
    return b''.join(out + [text[at:]])
