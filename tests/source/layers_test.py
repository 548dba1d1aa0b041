"""Modules include only themselves and those below: arrows point down, and nothing includes the program on top."""

import pathlib
import re
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
# From the bottom up. Studies may build on one another.
LAYERS = ('sim', 'vision', 'control', 'experiments/system', 'experiments/config', 'experiments/report', 'experiments/trial',
          'experiments/statistics', 'experiments/search', 'experiments/media', 'experiments/batch', 'experiments/serve',
          'experiments/page', 'experiments/command', 'experiments/studies', 'experiments/app', 'experiments/python')
INCLUDE = re.compile(r'^#include "((?:experiments/)?\w+)/', re.M)


def level(path):
    return LAYERS.index(re.match(r'(?:experiments/)?\w+', path)[0])


class Layers(unittest.TestCase):
    def test_no_module_includes_one_above_it(self):
        sources = [path.relative_to(ROOT).as_posix() for folder in ('sim', 'vision', 'control', 'experiments')
                   for path in (ROOT / folder).rglob('*.*') if path.suffix in ('.cc', '.h')]
        includes = [(source, include) for source in sources for include in INCLUDE.findall((ROOT / source).read_text())
                    if include in LAYERS]
        self.assertGreater(len(includes), 1000)  # else they are no longer found
        self.assertEqual([pair for pair in includes if level(pair[1]) > level(pair[0])], [])


if __name__ == '__main__':
    unittest.main()
