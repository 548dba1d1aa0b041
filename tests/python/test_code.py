"""The digest of a controller's code: what changes it, and what does not."""

import importlib
import io
import json
import os
import random
import subprocess
import sys
import textwrap
import threading
import tokenize

import pytest

import turbidock
from turbidock._code import digest_of

BEGIN = """
import abc, collections, dataclasses, decimal, enum, functools, math, pathlib, random, re, sys, typing
import numpy as np
import turbidock
"""
# Two sources of a class C: `|` ends a line, `{}` is where they differ, and what they have there follows.
CONTROLLER = "class C(turbidock.Controller):|  "
DEMAND = CONTROLLER + "def demand(self, seen, wanted):|    "
MADE = "def f(x):|  class C(turbidock.Controller):|    def demand(self, *seen): return x|  return C|C = f({})"
DIFFERS = {
    "constant": (DEMAND + "return [{}, 0, 0, 0]", "1", "2"),
    "kind of a constant": (DEMAND + "return [{}, 0, 0, 0]", "1", "1.0"),
    "sign of a zero": (DEMAND + "return [{}, 0, 0, 0]", "0.0", "-0.0"),
    "truth": (DEMAND + "return [{}, 0, 0, 0]", "True", "1"),
    "text": (DEMAND + "return self.vehicle[{}]", "'inertia'", "'damping'"),
    "tuple": (DEMAND + "return {}", "(1, 2)", "(1, 3)"),
    "digits": (DEMAND + "return {}", "(1, 35)", "(18, 3)"),
    "large number": (CONTROLLER + "x = 10**5000 + {}", "1", "2"),
    "set": (DEMAND + "return seen in {}", "{1, 2}", "{1, 3}"),
    "operator": (DEMAND + "return seen.rate {} wanted.rate", "+", "-"),
    "comparison": (DEMAND + "return seen.rate {} wanted.rate", "<", "<="),
    "attribute": (DEMAND + "return seen.{}", "rate", "position"),
    "name of a method": (CONTROLLER + "def {}(self, *seen): pass", "demand", "observe"),
    "order": (DEMAND + "{}|    return self.x", "self.x = 1; self.y = self.x", "self.y = self.x; self.x = 1"),
    "lambda": (DEMAND + "return (lambda x: x + {})(seen)", "1", "2"),
    "comprehension": (DEMAND + "return [x + {} for x in seen]", "1", "2"),
    "function in a function": (DEMAND + "def g():|      return {}|    return g()", "1", "2"),
    "class in a function": (DEMAND + "class D:|      x = {}|    return D.x", "1", "2"),
    "exception": (DEMAND + "try: return seen.x|    except {}: return 0", "KeyError", "ValueError"),
    "what is tried": (DEMAND + "{}", "try:|      x = 1|      y = 2|    except E: pass",
                      "x = 1|    try:|      y = 2|    except E: pass"),
    "default": (CONTROLLER + "def demand(self, seen, wanted={}): pass", "1", "2"),
    "keyword's default": (CONTROLLER + "def demand(self, seen, *, wanted={}): pass", "1", "2"),
    "kind of an argument": (CONTROLLER + "def demand(self, {}): pass", "*seen", "**seen"),
    "position only": (CONTROLLER + "def demand(self, seen{}): pass", "", ", /"),
    "keyword only": (CONTROLLER + "def demand(self, {}seen): pass", "", "*, "),
    "name of an argument": (CONTROLLER + "def demand(self, {}): pass", "seen", "wanted"),
    "attribute of a function": (CONTROLLER + "def demand(self): pass|  demand.x = {}", "1", "2"),
    "generator": (CONTROLLER + "{}def demand(self, seen): return 1", "", "async "),
    "closure": (MADE, "0.0", "3.0"),
    "array in a closure": (MADE, "np.array([1])", "np.array([2])"),
    "class attribute": (CONTROLLER + "gain = {}", "1", "2"),
    "list": (CONTROLLER + "gain = [1, {}]", "1", "2"),
    "dict": (CONTROLLER + "gain = dict(a={})", "1", "2"),
    "key of a dict": (CONTROLLER + "gain = {}", "{(1, 2): 1}", "{(1, 3): 1}"),
    "array": (CONTROLLER + "gain = np.array([1, {}])", "1", "2"),
    "array's type": (CONTROLLER + "gain = np.zeros(2, {})", "'f4'", "'i4'"),
    "array's shape": (CONTROLLER + "gain = np.zeros({})", "4", "(2, 2)"),
    "array of objects": (CONTROLLER + "gain = np.array([None, {}], object)", "1", "2"),
    "NumPy's number": (CONTROLLER + "gain = np.float32({})", "1", "2"),
    "generator's seed": (CONTROLLER + "rng = np.random.default_rng({})", "1", "2"),
    "random.Random": (CONTROLLER + "rng = random.Random({})", "1", "2"),
    "key": (CONTROLLER + "gain = turbidock.Key(1.0, 0, {})", "10", "20"),
    "path": (CONTROLLER + "file = pathlib.Path('{}')", "a", "b"),
    "NumPy's function": (CONTROLLER + "f = np.{}", "sin", "cos"),
    "wrapper of NumPy's function": ("@functools.wraps(np.mean)|def f(x): return {}|" + CONTROLLER + "f = f", "1", "2"),
    "Python's module": ("import {} as m|" + DEMAND + "return m.sin(1)", "math", "cmath"),
    "pattern": (CONTROLLER + "x = re.compile('{}')", "a", "b"),
    "Python's function": (CONTROLLER + "f = math.{}", "sin", "cos"),
    "lambda as a method": (CONTROLLER + "demand = lambda self, *seen: {}", "1", "2"),
    "static method": (CONTROLLER + "@staticmethod|  def f(): return {}", "1", "2"),
    "class method": (CONTROLLER + "@classmethod|  def f(cls): return {}", "1", "2"),
    "kind of a method": (CONTROLLER + "@{}|  def f(*x): pass", "staticmethod", "classmethod"),
    "property": (CONTROLLER + "@property|  def f(self): return {}", "1", "2"),
    "property's setter": (CONTROLLER + "f = property(None, lambda self, x: {})", "1", "2"),
    "property's deleter": (CONTROLLER + "f = property(None, None, lambda self: {})", "1", "2"),
    "function as of Numba": (
        "class J:|  def __reduce__(self): raise TypeError|  def __init__(self, f): self.py_func = f|"
        + CONTROLLER + "f = J(lambda self: {})", "1", "2"),
    "cached property": (CONTROLLER + "@functools.cached_property|  def f(self): return {}", "1", "2"),
    "cached function": (CONTROLLER + "@functools.lru_cache|  def f(self): return {}", "1", "2"),
    "partial": (CONTROLLER + "f = functools.partial(min, {})", "1", "2"),
    "nested class": (CONTROLLER + "class D:|    x = {}", "1", "2"),
    "base": ("class B(turbidock.Controller):|  x = {}|class C(B): pass", "1", "2"),
    "order of bases": ("class A: x = 1|class B: x = 2|class C({}, turbidock.Controller): pass", "A, B", "B, A"),
    "metaclass": ("class M(type):|  x = {}|class C(turbidock.Controller, metaclass=M): pass", "1", "2"),
    "decorator": ("def d(x):|  def e(f):|    def g(*a): return f(*a) + x|    return g|  return e|" + CONTROLLER
                  + "@d({})|  def f(self): return 1", "1", "2"),
    "decorated function": ("def d(f):|  @functools.wraps(f)|  def g(*a): return f(*a)|  return g|" + CONTROLLER
                           + "@d|  def f(self): return {}", "1", "2"),
    "class by type()": ("C = type('C', (turbidock.Controller,), dict(demand=lambda self, *seen: {}))", "1", "2"),
    "global": ("G = {}|" + DEMAND + "return G", "1", "2"),
    "global array": ("G = np.array([{}])|" + DEMAND + "return G", "1", "2"),
    "global function": ("def g(): return {}|" + DEMAND + "return g()", "1", "2"),
    "global of a global function": ("G = {}|def g(): return G|" + DEMAND + "return (lambda: g())()", "1", "2"),
    "global class": ("class G:|  def f(self): return {}|" + DEMAND + "return G().f()", "1", "2"),
    "global of a class in a function": ("G = {}|" + DEMAND + "class D:|      x = G|    return D.x", "1", "2"),
    "data class": ("@dataclasses.dataclass|class G:|  x: int = 1|G = G({})|" + DEMAND + "return G.x", "1", "2"),
    "object": ("class G:|  def __init__(self, x): self.x = x|G = G({})|" + DEMAND + "return G.x", "1", "2"),
    "object's class": ("class G:|  def f(self): return {}|G = G()|" + DEMAND + "return G.f()", "1", "2"),
    "object with slots": ("class G:|  __slots__ = ('x',)|G = G()|G.x = {}|" + DEMAND + "return G.x", "1", "2"),
    "bound method": ("class G:|  def f(self): return {}|G = G().f|" + DEMAND + "return G()", "1", "2"),
    "named tuple": ("G = collections.namedtuple('G', 'x')({})|" + DEMAND + "return G.x", "1", "2"),
    "ordered dict": ("G = collections.OrderedDict(x={})|" + DEMAND + "return G", "1", "2"),
    "deque": ("G = collections.deque([{}])|" + DEMAND + "return G", "1", "2"),
    "decimal": ("G = decimal.Decimal({})|" + DEMAND + "return G", "1", "2"),
    "enum's member": ("class E(enum.Enum):|  A = 1|  B = 2|" + CONTROLLER + "e = E.{}", "A", "B"),
    "enum's value": ("class E(enum.Enum):|  A = {}|" + CONTROLLER + "e = E.A", "1", "2"),
    "which of two": ("A, B = [1], [2]|" + CONTROLLER + "x = (A, B, {})", "A", "B"),
    "what makes an object": (
        "def f(): return {}|class G:|  def __reduce__(self): return f, ()|" + CONTROLLER + "x = G()", "1", "2"),
    "set in a cycle": (
        "class G: pass|G = G()|G.x, G.y = set([G]), {}|" + DEMAND + "return G", "1", "2"),
    "in a cycle": ("G = [{}]|G.append(G)|" + DEMAND + "return G", "1", "2"),
    "functions that call each other": ("def f(): g()|def g(): f(); return {}|" + DEMAND + "return f()", "1", "2"),
    "class that names itself": (DEMAND + "return super().demand(C.x)|  x = {}", "1", "2"),
    "module as of PyTorch": (
        "class N:|  def state_dict(self): pass|  def __init__(self, w, training):|    self.w = w|"
        "    self.training = training|N = N({})|" + DEMAND + "return N", "1, True", "2, True"),
    "model as of stable-baselines3": (
        "class N:|  def get_parameters(self): pass|  def __init__(self, w):|    self.policy = w|"
        "    self.env = open('/dev/null')|N = N({})|" + DEMAND + "return N", "1", "2"),
    "tensor as of PyTorch": (
        "class T:|  def __init__(self, x):|    self.x = np.array(x)|    self.graph = open('/dev/null')|"
        "  def detach(self): return self|  def cpu(self): return self|  def numpy(self): return self.x|"
        "T = T({})|" + DEMAND + "return T", "1", "2"),
}
SAME = {
    "comment": (DEMAND + "{}return [1, 0, 0, 0]", "", "# why|    "),
    "comment in an expression": (DEMAND + "return [1,{}|      0, 0, 0]", "", "|  # why||"),
    "docstring": (DEMAND + "{}|    return [1, 0, 0, 0]", "'''One'''", "'''Another'''"),
    "no docstring": (DEMAND + "{}return [None, 0, 0, 0]", "", "'''One'''|    "),
    "docstring of a class": (CONTROLLER + "{}x = 1", "", "'''One'''|  "),
    "docstring of a class in a function": (DEMAND + "class D:|      {}x = 1", "", "'''One'''|      "),
    "lines of a class in a function": (DEMAND + "{}class D:|      x = 1", "", "||    "),
    "annotation": (CONTROLLER + "x{} = 1|  def demand(self, seen{}): pass", "", ": typing.Any"),
    "order in a set": (CONTROLLER + "x = {}", "{'a', 'b', 'c'}", "{'c', 'b', 'a'}"),
    "order in a constant": (DEMAND + "return seen in {}", "{'a', 'b', 'c'}", "{'c', 'b', 'a'}"),
    "order in a dict": (CONTROLLER + "x = {}", "{'a': 1, (2, 3): 4}", "{(2, 3): 4, 'a': 1}"),
    "order of attributes": (CONTROLLER + "{}", "x = 1; y = 2", "y = 2; x = 1"),
    "order of methods": (CONTROLLER + "{}", "def f(s): pass|  def g(s): pass", "def g(s): pass|  def f(s): pass"),
    "global that is not named": ("G = {}|" + DEMAND + "return seen.G", "1", "2"),
    "global that cannot be told, not named": ("G = {}|" + DEMAND + "return seen.G", "1", "open('/dev/null')"),
    "equal objects that are one": (CONTROLLER + "{}", "x = (1.5, 2); y = (1.5, 2)", "x = y = (1.5, 2)"),
    "in a function": ("{}", "G = 1|" + CONTROLLER + "def demand(self): return G",
                      "def f():|  class C(turbidock.Controller):|    def demand(self): return G|  return C|"
                      "G, C = 1, f()"),
    "closure that holds nothing yet": (
        "def f():|  class C(turbidock.Controller):{}|"
        "    def demand(self): return x|  return C|  x = 1|C = f()", "", "|"),
    "path of the file": ("__file__ = '{}'|" + DEMAND + "return __file__", "a", "b"),
    "attribute of Python's module": (DEMAND + "{}return sys.stdout", "", "# why|    "),
    "class in C": (CONTROLLER + "x = {}type(None)", "", " "),
    "abstract base": ("class B(abc.ABC):{}|  @abc.abstractmethod|  def f(self): pass|"
                      "class C(B, turbidock.Controller): pass", "", "|"),
    "generic base": ("T = typing.TypeVar('T')|class B(typing.Generic[T]): pass|"
                     "class C(B{}, turbidock.Controller): pass", "[int]", "[float]"),
    "module of PyTorch that trained": (DIFFERS["module as of PyTorch"][0], "1, True", "1, False"),
}
NOT_TOLD = {
    "open file": CONTROLLER + "x = open('/dev/null')",
    "lock": "import threading|G = threading.Lock()|" + DEMAND + "return G",
    "socket": "import socket|G = [socket.socket()]|" + DEMAND + "return G",
    "generator": "G = (x for x in 'a')|" + DEMAND + "return G",
    "object whose state raises": "class G:|  def __reduce__(self): raise KeyError|G = G()|" + DEMAND + "return G",
    "name only": "class G:|  def __reduce__(self): return 'G'|G = G()|" + DEMAND + "return G",
}


def made(source, file="a.py", first_line=0):
    """The class C of a source, as a cell of a notebook makes it."""
    names = {"__name__": "__main__"}
    exec(compile(BEGIN + "\n" * first_line + source.replace("|", "\n"), file, "exec"), names)
    return names["C"]


def digest(source, **place):
    return digest_of(made(source, **place))


def both(row):
    pattern, a, b = row
    return pattern.replace("{}", a), pattern.replace("{}", b)


@pytest.mark.parametrize("what", DIFFERS)
def test_another_digest(what):
    one, other = map(digest, both(DIFFERS[what]))
    assert None not in (one, other) and one != other


@pytest.mark.parametrize("what", SAME)
def test_the_same_digest(what):
    one, other = map(digest, both(SAME[what]))
    assert one is not None and one == other


@pytest.mark.parametrize("what", NOT_TOLD)
def test_none_where_it_cannot_be_told(what):
    assert digest(NOT_TOLD[what]) is None


@pytest.mark.parametrize("hash_seed", ["1", "2"])
def test_the_same_in_another_process_with_another_file_and_line(hash_seed, tmp_path):
    sources = [source for row in [*DIFFERS.values(), *SAME.values()] for source in both(row)]
    program = ("import json, sys\nsys.path.insert(0, sys.argv[1])\nfrom test_code import digest\n"
               "print(json.dumps([digest(source, file='/b/c.py', first_line=300) for source in json.load(sys.stdin)]))")
    said = subprocess.run([sys.executable, "-c", program, os.path.dirname(__file__)], input=json.dumps(sources),
                          text=True, cwd=tmp_path, capture_output=True, check=True,
                          env={**os.environ, "PYTHONHASHSEED": hash_seed}).stdout
    assert json.loads(said) == list(map(digest, sources))


def controller(push):
    class Mine(turbidock.Controller):
        def demand(self, seen, wanted):
            return [push, 0, 0, 0]
    return Mine


def test_a_class_made_anew_is_the_same():
    assert digest_of(controller(0.0)) == digest_of(controller(0.0)) != digest_of(controller(3.0))


def test_it_is_the_same_after_many_calls():
    mine = made("G = 2|" + DEMAND + "for i in range(9): seen = seen + i * G|    return seen")
    before = digest_of(mine)
    for _ in range(1000):  # in which Python adapts its bytecode
        mine().demand(1, 2)
    assert digest_of(mine) == before


def test_what_is_changed_after_the_definition_counts():
    mine = controller(0.0)
    before = digest_of(mine)
    mine.gain = 1
    assert digest_of(mine) != before
    mine.gain = threading.Lock()
    assert digest_of(mine) is None


def test_the_registry_gets_it(monkeypatch):
    given = []

    class Plugins:
        def add_controller(self, *arguments):
            given.append(arguments[-1])

        add_estimator = add_controller

    class Locked(turbidock.Estimator):
        lock = threading.Lock()

    monkeypatch.setattr(turbidock.plug_in._core, "Plugins", Plugins)
    with pytest.warns(UserWarning, match="the code of locked cannot be told"):
        turbidock.plug_in.plugins_of([controller(1.0), Locked], kept=True)
    turbidock.plug_in.plugins_of([controller(1.0)])  # nothing is kept of a single trial
    assert given == [digest_of(controller(1.0)), "", ""]


MODULES = {
    "mine_a.py": "import mine_b\nfrom mine_c import part\nfrom mine_c.part import G\ndef f(x): return G\n",
    "mine_b.py": "H = 1\ndef g(x): return x\n",
    "mine_c/__init__.py": "from . import other\n",
    "mine_c/part.py": "G = 1\n",
    "mine_c/other.py": "X = 1\n",
}


def digest_with(folder, source, change):
    """In a fresh import of the modules, some changed."""
    for file, text in {**MODULES, **change}.items():
        (folder / file).parent.mkdir(exist_ok=True)
        (folder / file).write_text(text)
    importlib.invalidate_caches()
    for name in [name for name in sys.modules if name.startswith("mine_")]:
        del sys.modules[name]
    return digest(source)


@pytest.mark.parametrize("source", ["import mine_a|" + DEMAND + "return mine_a.f(1)",
                                    DEMAND + "import mine_a|    return mine_a.f(1)",
                                    "import mine_a as m|class C(turbidock.Controller):|  m = m"])
def test_modules_of_the_user_count_by_their_files(source, tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    before = digest_with(tmp_path, source, {})
    assert before is not None
    for file, text in MODULES.items():
        assert digest_with(tmp_path, source, {file: text + "K = 1\n"}) != before, file
        assert digest_with(tmp_path, source, {file: "# why\n\n" + text}) == before, file
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.syspath_prepend(str(tmp_path / "elsewhere"))
    assert digest_with(tmp_path / "elsewhere", source, {}) == before


def test_imports_in_functions_count(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    relative = "def g():\n    from . import other\n"
    for source, part, file in (("from mine_c.part import g|" + DEMAND + "return g()", relative, "mine_c/other.py"),
                               (DEMAND + "import mine_c.part", "", "mine_c/__init__.py")):
        files = {"mine_c/part.py": part, "mine_c/__init__.py": ""}
        before = digest_with(tmp_path, source, files)
        assert before is not None
        assert digest_with(tmp_path, source, {**files, file: "X = 2\n"}) != before


def test_a_module_changed_after_its_import_counts(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(tmp_path))
    source = "import mine_b|" + DEMAND + "return mine_b.H"
    before = digest_with(tmp_path, source, {})
    sys.modules["mine_b"].H = 2
    assert digest(source) != before
    sys.modules["mine_b"].H = 1
    assert digest(source) == before


def test_installed_packages_count_by_their_version(tmp_path, monkeypatch):
    site = tmp_path / "site-packages"
    site.mkdir()
    monkeypatch.syspath_prepend(str(site))
    monkeypatch.setattr(sys, "dont_write_bytecode", True)

    def with_version(version, text):
        turbidock._code._version.cache_clear()
        sys.modules.pop("packed", None)
        (site / "packed.py").write_text(f"__version__ = '{version}'\n{text}")
        importlib.invalidate_caches()
        return [digest(source) for source in ("import packed|" + DEMAND + "return packed.f()", DEMAND + "import packed",
                                              "from packed import f|" + DEMAND + "return f()",
                                              "from packed import held|" + CONTROLLER + "f = held(1)")]

    text = "K = {}\ndef f(): return K\ndef held(x): return lambda: (x, K)\n"
    one, other = with_version("1.0", text.format(1)), with_version("1.0", text.format(2))
    later = with_version("1.1", text.format(2))
    assert None not in one and one == other and not set(one) & set(later)
    assert digest("from packed import held|" + CONTROLLER + "f = held(2)") not in later


CHANGED = textwrap.dedent('''
    SCALE = 1.5
    TABLE = {"near": 0.25, "far": 4}

    def limited(value, most=2.5):
        if value > most:
            return most
        return -most if value < -most else value

    class C(turbidock.Controller):
        pose_filter = True
        gain = turbidock.Key(60.0, 3, 1000)

        def start(self):
            self.total = 7
            self.last = 11
            self.count = 13

        def demand(self, seen, wanted):
            error = seen.position - wanted.position
            speed = seen.rate - wanted.rate
            pushes = [
                limited(self.gain * error[5], 17),
                SCALE * error[19] + TABLE["near"] * speed[23],
            ]
            for push in pushes:
                self.total += push
            while self.count < 29:
                self.count = self.count + 31
            return [*pushes, max(self.total, self.last), sum(x / 37 for x in pushes)]
''')
INSTEAD = {"+": "-", "-": "+", "*": "/", "/": "*", ">": ">=", "<": ">", "+=": "-="}
NAMES = ["SCALE", "error", "speed", "push", "total", "last", "rate", "position", "max", "sum", "count"]
ORDERS = [("self.total = 7", "self.last = 11"), ("self.last = 11", "self.count = 13"),
          ("error = seen.position - wanted.position", "speed = seen.rate - wanted.rate")]


def edited(draw):
    """CHANGED with a number, an operator, a name or the order of two statements changed."""
    if draw.random() < 0.1:
        one, other = draw.choice(ORDERS)
        return CHANGED.replace(one, "@").replace(other, one).replace("@", other)
    tokens = list(tokenize.generate_tokens(io.StringIO(CHANGED).readline))
    stars = {at for at, token in enumerate(tokens) if token.string == "*" and tokens[at - 1].string == "["}
    at = draw.choice([at for at, token in enumerate(tokens) if at not in stars and (
        token.type == tokenize.NUMBER or token.string in INSTEAD or token.string in NAMES)])
    token = tokens[at]
    if token.type == tokenize.NUMBER:
        new = repr(type(eval(token.string))(eval(token.string) + draw.randint(1, 99)))
    elif token.type == tokenize.NAME:
        new = draw.choice([name for name in NAMES if name != token.string])
    else:
        new = INSTEAD[token.string]
    (row, begin), (_, end) = token.start, token.end
    lines = CHANGED.splitlines(keepends=True)
    lines[row - 1] = lines[row - 1][:begin] + new + lines[row - 1][end:]
    return "".join(lines)


def test_small_edits_change_it_and_comments_do_not():
    draw = random.Random(5)
    before = digest(CHANGED)
    assert before is not None
    for _ in range(200):
        text = edited(draw)
        assert digest(text) not in (before, None), text
    for _ in range(50):
        lines = CHANGED.splitlines()
        for _ in range(draw.randint(1, 5)):
            at = draw.randrange(1, len(lines))
            if draw.random() < 0.5:
                lines.insert(at, draw.choice(["", " " * draw.randrange(9) + "# why", "    "]))
            elif lines[at].strip():
                lines[at] += draw.choice(["  # because", "   "])
        assert digest("\n".join(lines) + "\n") == before, "\n".join(lines)
