"""Builds the manual from README files and headers: `manual.py OUT`. Doxygen reads a copy of them in OUT/source, in which plain
`//` comments are its own and links are those that it knows; a warning of it, a dead link or a lost heading is an error."""

import html.parser
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import urllib.parse

ROOT = pathlib.Path(__file__).resolve().parents[1]
PARTS = ('assets', 'control', 'experiments', 'models', 'sim', 'vision')
PICTURES = ('.jpg', '.png', '.svg')


def header(text):
    """`//` comments as `///`, with their signs as they are written; examples, which are indented, as they are."""

    def documented(match):
        indent, comment = match.groups()
        if not comment.startswith('    '):
            comment = re.sub(r'([\\<@])', r'\\\1', comment)
        return f'{indent}///{comment}'

    text = re.sub(r'^(extern )?template .*?[^:];$', lambda m: '' if '{' not in m[0] else m[0], text, flags=re.M | re.S)
    return re.sub(r'^([ \t]*)//(.*)$', documented, text, flags=re.M)


def page(text, folder):
    """Pictures by their names, links to other pages from the root and without an anchor, links to what is no page as text."""

    def linked(match):
        # Doxygen 1.9.4 loses what follows words on two lines, up to the next page.
        words, target = ' '.join(match[1].split()), match[2]
        path, _, anchor = target.partition('#')
        if path.endswith(PICTURES):
            return f'[{words}]({os.path.basename(path)})'
        if '://' in target:
            return match[0]
        # Doxygen 1.9.4 shows the marks of code in a link's words.
        path += '.md' if path.endswith('.ipynb') else ''
        return f'[{words.replace("`", "")}]({os.path.normpath(folder / path)})' if path.endswith('.md') else words

    text = re.sub(r'\A# turbidock$', '# turbidock {#mainpage}', text, flags=re.M)
    # Of a word in angle brackets it makes HTML, but for those in code.
    text = re.sub(r'^[^`\n]*<[a-z][^`\n]*$', lambda line: re.sub(r'<(?=[a-z])', r'\\<', line[0]), text, flags=re.M)
    # Doxygen takes `it's` for the end of a quotation unless its marks are double.
    text = re.sub(r'(`+)([^`]+)\1', lambda code: f'``{code[2]}``' if len(code[1]) == 1 and "'" in code[2] else code[0], text)
    return re.sub(r'\[([^\]]*)\]\(([^)\s]*)\)', linked, text)


def notebook(text):
    """A notebook as a page: its texts and its code."""
    cells = [(cell['cell_type'], ''.join(cell['source'])) for cell in json.loads(text)['cells']]
    return '\n\n'.join(f'```py\n{source}\n```' if kind == 'code' else source for kind, source in cells) + '\n'


def copy_sources(out):
    names = subprocess.run(['git', 'ls-files', '*.md', '*.ipynb', *(f'{p}/*.h' for p in PARTS),
                            'experiments/python/turbidock/*.py'], cwd=ROOT, capture_output=True, text=True, check=True).stdout.split()
    for name in names:
        if name.startswith('.'):
            continue
        target = out / name
        target.parent.mkdir(parents=True, exist_ok=True)
        text = (ROOT / name).read_text()
        if name.endswith('.ipynb'):
            name += '.md'
            target, text = out / name, notebook(text)
        target.write_text(header(text) if name.endswith('.h') else page(text, pathlib.Path(name).parent) if name.endswith('.md') else text)


class Links(html.parser.HTMLParser):
    def __init__(self, path):
        super().__init__()
        self.found = []
        self.feed(path.read_text())

    def handle_starttag(self, tag, attributes):
        self.found += [value for key, value in attributes if key in ('href', 'src') and value]


def dead_links(site):
    for path in sorted(site.glob('*.html')):
        for link in Links(path).found:
            url = urllib.parse.urlparse(link)
            if not url.scheme and url.path and not (site / urllib.parse.unquote(url.path)).exists():
                yield f'{path.name}: {link}'


def pages_without_a_heading(site, source):
    """Doxygen drops headings without a word where it misreads what stands before them."""
    for path in sorted(source.rglob('*.md')):
        name = path.relative_to(source).with_suffix('').as_posix()
        html = (site / ('index.html' if name == 'README' else f'md_{re.sub("[/.]", "_", name)}.html')).read_text()
        text = re.sub(r'^```.*?^```', '', path.read_text(), flags=re.M | re.S)
        wanted, found = len(re.findall(r'^#+ ', text, re.M)) - 1, len(set(re.findall(r'id="(autotoc_md\d+)"', html)))
        if found != wanted:
            yield f'{name}.md: {wanted} headings below its title, {found} in the manual'


def main(out):
    shutil.rmtree(out, ignore_errors=True)
    copy_sources(out / 'source')
    version = re.search(r'^version = "(.*)"', (ROOT / 'pyproject.toml').read_text(), re.M)[1]
    settings = (ROOT / 'cmake/Doxyfile').read_text() + f'PROJECT_NUMBER = {version}\nIMAGE_PATH = {ROOT}/assets/pictures\n'
    settings += f'HTML_EXTRA_STYLESHEET = {ROOT}/cmake/manual.css\n'
    failed = subprocess.run(['doxygen', '-'], cwd=out / 'source', input=settings, text=True).returncode
    faults = [f'a dead link: {link}' for link in dead_links(out)] + list(pages_without_a_heading(out, out / 'source'))
    shutil.rmtree(out / 'source')
    print(*faults, sep='\n', end='\n' if faults else '')
    return 1 if failed or faults else 0


if __name__ == '__main__':
    sys.exit(main(pathlib.Path(sys.argv[1]).resolve()))
