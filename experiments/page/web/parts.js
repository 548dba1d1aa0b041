// What every kind of page has: heading, badge, facts, commands, tables.

import {button, fill, h, section} from 'page/dom.js';
import {words} from 'page/format.js';

const kGood = new Set(['success', 'pass', 'none']);
const kNeutral = new Set(['interrupted', 'inconclusive']);
const toneOf = word => (kGood.has(word) ? 'good' : kNeutral.has(word) ? 'none' : 'bad');

/** What the outcomes of a trial mean. */
const kMeaning = {
  success: 'the criterion was met and the pole is in the hole',
  false_dock: 'the criterion was met on the estimate, but the pole is not in the hole',
  timeout: 'the time was up',
  marker_lost: 'the marker was found once and then lost for too long',
  gave_up: 'all attempts to dock failed',
  collision: 'the vehicle touched something other than the inside of the dock',
  diverged: 'the physics gave no usable state',
  interrupted: 'somebody stopped it',
  crashed: 'its process ended',
  hung: 'its process was stopped after its time limit',
  no_answer: 'a program that steers or sees for the vehicle did not answer',
};

/** A word with its tone, said by more than colour. */
export const badge = (word, tone = toneOf(word)) =>
  h(
    'span',
    {class: `badge ${tone}`, title: kMeaning[word.replaceAll(' ', '_')]},
    h('span', {'aria-hidden': 'true'}, {good: '✓ ', bad: '✕ ', none: '• '}[tone]),
    words(word),
  );

/** [{label, value, note: how it is meant}] side by side. */
export const facts = list =>
  h(
    'dl',
    {class: 'facts'},
    list.map(({label, value, note}) =>
      h('div', {title: note || null}, h('dt', {}, label), h('dd', {}, value)),
    ),
  );

/** The first screen's heading, and what the page cannot show: elements. */
export const head = ({badge: mark, title, reason, note, facts: list, missing = []}) => [
  h(
    'header',
    {class: 'column head'},
    h('div', {class: 'line'}, h('h1', {}, title), mark, note && h('span', {class: 'note'}, note)),
    reason ? h('p', {class: 'reason'}, reason) : null,
    list?.length ? facts(list) : null,
  ),
  ...missing.map(text => h('p', {class: 'missing'}, text)),
];

/** A command to copy, and what it does. */
export function command({what, command: text}) {
  const code = h('code', {}, text);
  const copy = async () => {
    try {
      await navigator.clipboard.writeText(text);
      fill(copyButton, 'Copied');
    } catch {
      getSelection().selectAllChildren(code);
    }
  };
  const copyButton = button('Copy', copy, {title: `copy: ${text}`});
  return h(
    'div',
    {class: 'command'},
    what ? h('span', {class: 'note'}, what) : null,
    h('div', {class: 'line'}, code, copyButton),
  );
}

/** What can be scrolled, also by keys. */
export const scrolled = (label, ...children) =>
  h('div', {class: 'scroll', tabindex: 0, role: 'region', 'aria-label': label}, children);

/** A small table: {columns: [{label, numeric}], rows: [[text or {text, tone, title, onclick}]]}. */
export function plainTable({columns, rows}) {
  const row = (cells, of) => h('tr', {}, cells.map(of));
  const cell = (value, k) => {
    const {text, tone, title, onclick} =
      value !== null && typeof value === 'object' ? value : {text: value ?? '–'};
    const names = [columns[k].numeric ? 'numeric' : '', tone || ''].join(' ').trim();
    return h(
      k === 0 ? 'th' : 'td',
      {title, scope: k === 0 ? 'row' : null, class: names || null},
      onclick ? button(text, onclick, {class: 'link', title}) : text,
    );
  };
  const heading = ({label, numeric}) =>
    h('th', {scope: 'col', class: numeric ? 'numeric' : null}, label);
  return scrolled(
    columns.map(c => c.label).join(', '),
    h(
      'table',
      {class: 'plain'},
      h('thead', {}, row(columns, heading)),
      h(
        'tbody',
        {},
        rows.map(cells => row(cells, cell)),
      ),
    ),
  );
}

/** Shows what was asked for below, where the keyboard goes on. */
export function reveal(element) {
  element.tabIndex = -1;
  element.scrollIntoView({block: 'start'});
  element.focus({preventScroll: true});
}
