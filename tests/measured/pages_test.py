"""The pages of measured results: drawn from their files, and what is malformed is refused."""

import csv
import pathlib
import re
import sys
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "assets/measured"))
sys.dont_write_bytecode = True

import draw  # noqa: E402
import making  # noqa: E402
import tables_checks, tables_docking, tables_estimator, tables_speed  # noqa: E401,E402,F401

MOST_WORDS, MOST_WORDS_OF_PAGE = 12000, 1500

ORIGIN = "# title: Docked\n# command: turbidock batch x\n# build: abc\n# machine: two cores\n# date: 2026-11-21\n"
TABLE = draw.read_table(ORIGIN + 'milk,"docked, of 30"\n0,\n20,"a|b"\n', "t.csv")


def pages():
    return [*ROOT.glob("*.md")] + [page for module in ("assets", "control", "experiments", "models", "sim", "tests", "vision")
                                   for page in (ROOT / module).rglob("*.md") if "node_modules" not in page.parts]


def rows_of(name):
    """Of a table's file, without its origin and its columns' names."""
    lines = (ROOT / f"assets/measured/{name}.csv").read_text().splitlines()
    return list(csv.reader(line for line in lines if not line.startswith("#")))[1:]


class Readme(unittest.TestCase):
    """What README says in numbers is what the tables say."""
    TEXT = (ROOT / "README.md").read_text()

    def test_has_the_envelope(self):
        rows = rows_of("docking_envelope")
        for column, error in ((1, "3 cm"), (2, "21 cm")):
            cells = []
            for row in rows:
                cell = row[column].replace("before 0", "none").replace("beyond ", ">")
                cells.append(re.sub(r"[\d.]+", lambda number: f"{float(number[0]):.0f}", cell))
            self.assertIn(f"| {error} | {' | '.join(cells)} |", self.TEXT)
        trials, hours = (sum(float(row[column]) for row in rows) for column in (4, 5))
        self.assertIn(f"{trials:.0f} trials, {hours:.1f} processor hours", self.TEXT)

    def test_has_the_published_night(self):
        active, passive, _, brought = (f"{row[3]} of {row[2]}" for row in rows_of("docking_published_night"))
        self.assertIn(f"active marker {active}; passive {passive}, with a pilot {brought}", self.TEXT)


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


class Measuring(unittest.TestCase):
    def test_every_table_can_be_made_and_says_by_what(self):
        tables = draw.load_tables(ROOT / "assets/measured")
        self.assertEqual(set(tables), set(making.TABLES))
        self.assertLessEqual(len(tables), 36)
        for name, table in making.TABLES.items():
            origin = draw.read_origin((ROOT / f"assets/measured/{name}.csv").read_text(encoding="utf-8"), name)[0]
            self.assertEqual(origin["command"], table.shown, name)
            if all(command.quick is None for command in table.commands):
                self.assertTrue(table.elsewhere, f"{name} is tried by nothing")

    def test_quick_options_take_the_place_of_those_before(self):
        command = making.turbidock("batch x --seeds 40 --set a=1 --set b=2 --out x.db", quick="--seeds 1 --set b=3 --shard 1/2")
        self.assertEqual(" ".join(command.quickly()), "turbidock batch x --set a=1 --out x.db --seeds 1 --set b=3 --shard 1/2")
        other = making.turbidock("tune a", quick=("turbidock", "tune", "b"))
        self.assertEqual(other.quickly(), ("turbidock", "tune", "b"))

    def test_cells_say_counts_and_medians(self):
        self.assertEqual(making.share(195, 200), "195 of 200 (94-99 %)")  # Wilson's: 0.943 to 0.989
        self.assertEqual(making.share(0, 12, ""), "0 (0-24 %)")
        trials = [{"outcome": outcome, "failure": failure, "time_s": time_s, "final_error_true_y_m": -0.004, "final_error_true_z_m": 0.002}
                  for outcome, failure, time_s in (("success", "none", 10), ("timeout", "never_found", 60), ("success", "none", 13),
                                                   ("timeout", "never_found", 60), ("false_dock", "false_lock", 9))]
        held = making.docked(trials)
        self.assertEqual((len(held), making.median(held, "time_s", 1), making.aside(held)), (2, "11.5", "4, 2"))
        self.assertEqual((making.failures(trials), making.beside(trials)), ("2 never found, 1 false lock", 1))
        self.assertEqual((making.median([], "time_s"), making.aside([]), making.share(0, 0)), ("", "", ""))

    def test_faults_are_written_plainly(self):
        self.assertEqual(tables_docking.plain("{images: [{kind: late, late_images: 6, begin_s: 6}]}"),
                         "images: kind late, late_images 6, begin_s 6")
        self.assertEqual(tables_docking.plain("{}"), "none")


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

    def test_pages_are_short(self):
        words = {page.name: len(page.read_text(encoding="utf-8").split()) for page in (ROOT / "assets/measured").glob("*.md")}
        self.assertEqual({name: count for name, count in words.items() if count > MOST_WORDS_OF_PAGE}, {})
        self.assertLessEqual(sum(words.values()), MOST_WORDS)

    def test_pages_link_to_files_that_are_there(self):
        checked = 0
        for page in pages():
            for target in re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8")):
                self.assertTrue((page.parent / target).exists(), f"{page} links to {target}")
                checked += 1
        self.assertGreaterEqual(checked, 40)


if __name__ == "__main__":
    unittest.main()
