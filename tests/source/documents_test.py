"""The documents tell the truth: every link and every file that they name exists, and so do the commands and options that they
show. `documents_test.py [PROGRAM]`; without PROGRAM the commands are left out."""

import pathlib
import re
import shlex
import subprocess
import sys
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAM = None
# What the program wrote or was like at the time: dated records, and the list of what is gone.
RECORDS = ('assets/measured/', 'CHANGELOG.md')
# Of each README, and of all documents but the dated records.
MOST_WORDS_OF_README, MOST_WORDS = 600, 12000

LINK = re.compile(r'\]\(([^)\s]+)\)')
FENCE = re.compile(r'^```sh\n(.*?)^```', re.S | re.M)
FOLDERS = ('assets/', 'cmake/', 'control/', 'experiments/', 'models/', 'sim/', 'tests/', 'vision/')
# `sim/base/frames.h`, `models/*.xml`, `batch/plan.{h,cc}`: a path, not a key or a command.
PATH = re.compile(r'`((?:[\w.-]+/)+[\w.*{},-]*)`')


def documents():
    names = subprocess.run(['git', 'ls-files', '*.md'], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    return [ROOT / name for name in names.split()]


def commands_of(text):
    """The lines of `sh` blocks that call the program, as lists of words."""
    for block in FENCE.findall(text):
        for line in block.replace('\\\n', ' ').splitlines():
            words = shlex.split(line, comments=True)
            while words and ('=' in words[0] or words[0] in ('time', 'nice')):
                words = words[1:]
            if len(words) > 1 and words[0].split('/')[-1] == 'turbidock':
                yield line, words[1:]


def helped(command):
    return subprocess.run([PROGRAM, command, '--help'], capture_output=True, text=True).stdout


class Documents(unittest.TestCase):
    def test_links_lead_to_files(self):
        dead = []
        for document in documents():
            for target in LINK.findall(document.read_text()):
                if '://' in target or target.startswith(('#', 'mailto:')):
                    continue
                if not (document.parent / target.split('#')[0]).exists():
                    dead.append(f'{document.relative_to(ROOT)}: {target}')
        self.assertEqual(dead, [])

    def test_paths_exist(self):
        missing = []
        for document in documents():
            name = str(document.relative_to(ROOT))
            if name.startswith(RECORDS):
                continue
            for path in PATH.findall(document.read_text()):
                if not path.startswith(FOLDERS) or '{' in path or 'NAME' in path:
                    continue
                if not (list(ROOT.glob(path.rstrip('/'))) or list(document.parent.glob(path.rstrip('/')))):
                    missing.append(f'{name}: {path}')
        self.assertEqual(missing, [])

    def test_commands_and_options_exist(self):
        if not PROGRAM:
            return
        helps, wrong, seen = {}, [], 0
        for document in documents():
            name = str(document.relative_to(ROOT))
            if name.startswith(RECORDS):
                continue
            for line, words in commands_of(document.read_text()):
                seen += 1
                command = words[0]
                if command.startswith('-'):
                    continue
                known = helps.setdefault(command, helped(command))
                if not known:
                    wrong.append(f'{name}: {line}')
                for word in words[1:]:
                    option = re.match(r'--[\w-]+', word)
                    if option and not re.search(rf'{option[0]}\b(?!-)', known):
                        wrong.append(f'{name}: {option[0]} in: {line}')
        self.assertGreater(seen, 30)  # else the blocks are no longer found
        self.assertEqual(wrong, [])

    def test_bundled_files_are_named_not_sought(self):
        # who has the program from a package has no such folder; footage has no names
        sought = [line for document in documents() for line, words in commands_of(document.read_text())
                  for word in words if word.startswith('assets/') and not word.startswith('assets/footage/')]
        self.assertEqual(sought, [])

    def test_outcomes_are_those_of_the_program(self):
        names = re.search(r'EnumList<Outcome>\((.*?)\);', (ROOT / 'experiments/trial/trial_record.h').read_text(), re.S)[1]
        table = (ROOT / 'experiments/trial/README.md').read_text().partition('| Outcome |')[2].partition('\n\n')[0]
        cells = ' '.join(row.split('|')[1] for row in table.splitlines() if row.startswith('|'))
        self.assertEqual(re.findall(r'`(\w+)`', cells), re.findall(r'"(\w+)"', names))

    def test_headings_are_headings(self):
        # "#heading" is what clang-format makes of "# heading"
        self.assertEqual([str(document) for document in documents() if re.match(r'#+[^# ]', document.read_text())], [])

    def test_are_short(self):
        words = {}
        for document in documents():
            name = str(document.relative_to(ROOT))
            if not name.startswith(RECORDS[0]):
                words[name] = sum(1 for word in document.read_text().split() if re.search(r'\w', word))
        long = {name: count for name, count in words.items() if name.endswith('README.md') and count > MOST_WORDS_OF_README}
        self.assertEqual(long, {})
        self.assertLessEqual(sum(words.values()), MOST_WORDS)


if __name__ == '__main__':
    if len(sys.argv) > 1 and not sys.argv[1].startswith('-'):
        PROGRAM = sys.argv.pop(1)
    unittest.main()
