"""The pages of measured results: drawn from their files, and what is malformed is refused."""

import contextlib
import io
import pathlib
import re
import sqlite3
import sys
import tempfile
import unittest
from unittest import mock

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "assets/measured"))
sys.dont_write_bytecode = True

import draw  # noqa: E402
import outcomes  # noqa: E402

ORIGIN = "# title: Docked\n# command: turbidock batch x\n# build: abc\n# machine: two cores\n# date: 2026-11-21\n"
TABLE = draw.read_table(ORIGIN + 'milk,"docked, of 30"\n0,\n20,"a|b"\n', "t.csv")


def pages():
    return [*ROOT.glob("*.md")] + [page for module in ("assets", "control", "experiments", "models", "sim", "tests", "vision")
                                   for page in (ROOT / module).rglob("*.md") if "node_modules" not in page.parts]


class ResultFile(unittest.TestCase):
    def test_is_a_table_with_its_origin_below(self):
        self.assertEqual(TABLE, ["| milk | docked, of 30 |", "|---|---|", "| 0 | |", "| 20 | a\\|b |", "",
                                 "Docked. `turbidock batch x`. Build: abc; machine: two cores; date: 2026-11-21."])

    def test_is_refused_with_its_line_when_it_is_malformed(self):
        for text, message in (
                ("milk\n0\n", 't.csv:1: no "# title'),
                (ORIGIN + "# machine: three\nmilk\n0\n", "t.csv:6: machine is given twice"),
                (ORIGIN.replace("build", "bulid") + "milk\n0\n", "t.csv:3: unknown key bulid"),
                (ORIGIN + "#date 3\nmilk\n0\n", 't.csv:6: must be "# key: value"'),
                (ORIGIN + "milk,docked\n0\n", "t.csv:7: 1 cells under 2 columns"),
                (ORIGIN + "milk,docked\n\n0,1\n", "t.csv:7: 0 cells under 2 columns"),
                (ORIGIN + 'milk,docked\n0,"1\n', "t.csv:7: unexpected end"),
                (ORIGIN + "milk,docked\n", "t.csv:6: no rows"),
                (ORIGIN, "t.csv:5: no rows")):
            with self.subTest(text), self.assertRaises(draw.Malformed) as refused:
                draw.read_table(text, "t.csv")
            self.assertIn(message, str(refused.exception))


class Outcomes(unittest.TestCase):
    def rows_of(self, trials):
        """What outcomes.py says of these trials (faults, outcome, failure, time, reason, inserted), and its exit code."""
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "a.db"
            with contextlib.closing(sqlite3.connect(file)) as db, db:
                db.execute("CREATE TABLE meta (key, value)")
                db.execute("INSERT INTO meta VALUES ('build', '0.1.0 abc')")
                db.execute("CREATE TABLE results (cell, sample, faults, outcome, failure, time_s, reason, inserted)")
                db.executemany("INSERT INTO results VALUES (?, ?, ?, ?, ?, ?, ?, ?)", trials)
            out = io.StringIO()
            with contextlib.redirect_stdout(out), mock.patch("sys.argv", ["", str(file), "faults", "--title", "T"]):
                code = outcomes.main()
            return code, out.getvalue().splitlines()

    def test_are_counted_by_group(self):
        fault = "{images: [{kind: late, late_images: 6, begin_s: 6}]}"
        code, lines = self.rows_of([(0, 0, "{}", "success", "none", 10, "in", 1), (1, 0, fault, "success", "none", 12, "in", 1),
                                    (1, 1, fault, "timeout", "oscillation", 45, "late", 0)])
        self.assertEqual(code, 0)
        self.assertIn("# build: abc", lines)
        self.assertEqual(lines[-2:], ["none,1 success,1 none,10.0,",
                                      '"images: kind late, late_images 6, begin_s 6","1 success, 1 timeout",'
                                      '"1 none, 1 oscillation",28.5,late'])

    def test_false_dock_is_an_error(self):
        self.assertEqual(self.rows_of([(0, 0, "{}", "success", "none", 10, "beside", 0)])[0], 1)


class Page(unittest.TestCase):
    def test_keeps_everything_but_its_tables(self):
        for end in ("\n", "\r\n"):
            page = end.join(["# Head", "<!-- measured t -->", "old", "<!-- end measured -->", "```",
                             "<!-- measured none -->", "```", "no newline at the end"])
            drawn, shown = draw.draw_page(page, "p.md", {"t": TABLE})
            self.assertEqual(drawn, page.replace("old" + end, "".join(line + end for line in TABLE)))
            self.assertEqual(shown, ["t"])
            self.assertEqual(draw.draw_page(drawn, "p.md", {"t": TABLE})[0], drawn)

    def test_is_refused_with_its_line(self):
        for page, message in (("<!-- measured u -->\n<!-- end measured -->\n", "p.md:1: no result file u.csv"),
                              ("a\n<!-- measured t -->\n", "p.md:2: table t has no"),
                              ("<!-- measured t -->\n<!-- measured t -->\n", "p.md:1: table t has no"),
                              ("a\n<!-- end measured -->\n", "p.md:2: <!-- end measured --> without")):
            with self.subTest(page), self.assertRaises(draw.Malformed) as refused:
                draw.draw_page(page, "p.md", {"t": TABLE})
            self.assertIn(message, str(refused.exception))


class Repository(unittest.TestCase):
    def test_pages_show_what_the_result_files_hold(self):
        tables, everywhere = draw.load_tables(ROOT / "assets/measured"), set()
        for page in pages():
            text = page.read_text(encoding="utf-8")
            drawn, shown = draw.draw_page(text, page, tables)
            self.assertEqual(text, drawn, f"python3 assets/measured/draw.py {page} draws it anew")
            everywhere.update(shown)
        self.assertEqual(everywhere, set(tables), "every result file is shown on some page")
        self.assertGreaterEqual(len(tables), 20)

    def test_pages_link_to_files_that_are_there(self):
        checked = 0
        for page in pages():
            for target in re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8")):
                self.assertTrue((page.parent / target).exists(), f"{page} links to {target}")
                checked += 1
        self.assertGreaterEqual(checked, 40)


if __name__ == "__main__":
    unittest.main()
