"""Names and texts use the field's words: what CONTRIBUTING.md calls private language does not come back."""

import pathlib
import re
import subprocess
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
# Records of what was, and this list itself.
LEFT_ALONE = ('assets/measured/', 'CHANGELOG.md', 'LICENSE', 'cmake/changelog',
              'tests/source/words_test.py', 'tests/page/browser/package-lock.json')
SUFFIXES = ('.cc', '.h', '.py', '.pyi', '.js', '.mjs', '.css', '.yaml', '.xml', '.txt', '.md', '.cmake', '.sh', '.in', '.yml')
# What must not be found: what to write instead.
WORDS = {
    r'[Bb]erth': 'moored body',
    r'\b[Rr]ivals?\b': 'baseline, or the thing itself',
    r'\bappetite\b': 'max_in_flight',
    r'creep_share': 'local_mutation_rate',
    r'\b[Kk]nock': 'camera misalignment',
    r'vane_length': 'weathervane_arm',
    r'DayFault': 'ambient light',
    r'(?<!Null)\bVisitors?(Faults|Of)?\b|\bvisitors_?\b': 'distractor',
    r'\b[Ff]lakes?\b|flakes_per': 'particle',
    r'\bEyes\b|\bSeeWhole\b': 'Perception, SetFullFrame',
    r'\bOwnLaw\b|\bLawPlugin|\bLaw::': 'controller',
    r'\bTakeIn\b|\bSwung\b': 'Insert, RotatedAboutBallAxis',
    r'\bWorth\b|\bworths\b': 'objective values',
    r'\b[Dd]ose\b|\b[Dd]oses\b|DosePoint|half_dose': 'independent variable, x',
    r'\b[Ff]arms?\b|FarmOptions': 'batch, job runner',
    r'turbidock_room|\broom:[a-z]|\bthe rooms\b|\b[Aa] room of\b': 'module',
    r'milk of loss': 'turbidity limit',
    r'\b(are|is) not stood\b|\bnot stood are\b': 'the estimator fails when ...',
    r'(?<!")"[^"\n]*[a-z)] \[(mm|deg|°|Hz|dB|V|N|N m)\]': 'a comma before the unit: "x, mm"',
}


def texts():
    names = subprocess.run(['git', 'ls-files'], cwd=ROOT, capture_output=True, text=True, check=True).stdout.split('\n')
    for name in names:
        if name.endswith(SUFFIXES) and not name.startswith(LEFT_ALONE) and (ROOT / name).exists():
            yield name, (ROOT / name).read_text(encoding='utf-8', errors='replace')


class Words(unittest.TestCase):
    def test_no_private_language(self):
        found = []
        for name, text in texts():
            for word, instead in WORDS.items():
                for match in re.finditer(word, text):
                    line = text.count('\n', 0, match.start()) + 1
                    found.append(f'{name}:{line}: "{match[0]}", say {instead}')
        self.assertEqual(found, [])

    def test_controllers_and_estimators_are_named_where_they_are_registered(self):
        names = re.compile(r'\b(p_voltage|pid|lqg|playback|rm_ga|blobs|fiducial)\b')
        files = [path for pattern in ('control/autopilot.*', 'experiments/trial/scenario.*', 'experiments/trial/running_trial.*')
                 for path in ROOT.glob(pattern)]
        self.assertEqual(len(files), 6)
        found = [f'{path.name}: {match[0]}' for path in files for match in names.finditer(path.read_text())]
        self.assertEqual(found, [])

    def test_nothing_but_resolve_sets_a_scenarios_keys(self):
        # `model_files` are no key's: what its files held
        sets = re.compile(r'\b(?:scenario|\w*_scenario|limited)\.(?!model_files|plugins\b)[a-z_.]+ = ')
        files = [path for path in (ROOT / 'experiments').rglob('*.cc') if path.name != 'scenario.cc' and path.parent.name != 'app']
        self.assertGreater(len(files), 100)
        found = [f'{path.name}: {match[0]}' for path in files for match in sets.finditer(path.read_text())]
        self.assertEqual(found, [])


if __name__ == '__main__':
    unittest.main()
