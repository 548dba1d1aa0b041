// What every kind of page has: heading, badge, facts, commands, notes.

import {h, button} from 'page/dom.js';
import {words} from 'page/format.js';

const kGood = new Set(['docked', 'pass', 'none']);
const kNeutral = new Set(['interrupted', 'inconclusive', 'running', 'partial']);

export const toneOf = word => (kGood.has(word) ? 'good' : kNeutral.has(word) ? 'none' : 'bad');

/** A word with its tone, said by more than colour. */
export const badge = (word, tone = toneOf(word)) =>
  h(
    'span',
    {class: `badge ${tone}`},
    h('span', {'aria-hidden': 'true'}, {good: '✓ ', bad: '✕ ', none: '• '}[tone]),
    words(word),
  );

/** [[label, value, explanation]] side by side. */
export const facts = list =>
  h(
    'dl',
    {class: 'facts'},
    list.map(([label, value, why]) =>
      h('div', {title: why}, h('dt', {}, label), h('dd', {}, value)),
    ),
  );

/** The first screen's heading. */
export function head({badge: mark, title, reason, note, facts: list}) {
  return h(
    'header',
    {class: 'head'},
    h(
      'div',
      {class: 'head-title'},
      h('h1', {}, title),
      mark,
      note ? h('span', {class: 'note'}, note) : null,
    ),
    reason ? h('p', {class: 'reason'}, reason) : null,
    list ? facts(list) : null,
  );
}

/** A command to copy. */
export function command(text, what) {
  const copy = button(
    'Copy',
    async () => {
      try {
        await navigator.clipboard.writeText(text);
        copy.textContent = 'Copied';
      } catch {
        getSelection().selectAllChildren(code);
      }
    },
    {title: `copy: ${text}`},
  );
  const code = h('code', {}, text);
  return h(
    'div',
    {class: 'command'},
    what ? h('span', {class: 'note'}, what) : null,
    h('div', {}, code, copy),
  );
}

/** A small table of texts: {columns: [{label, numeric}], rows: [[...]]}. A cell may be {text, tone, title, onclick}. */
export function plainTable({columns, rows, caption}) {
  const cell = (value, k) => {
    const tag = k === 0 ? 'th' : 'td';
    const text = value !== null && typeof value === 'object' ? value.text : value;
    const inner = value?.onclick
      ? button(text, value.onclick, {class: 'link', title: value.title})
      : (text ?? '–');
    return h(
      tag,
      {
        title: value?.title,
        scope: k === 0 ? 'row' : null,
        class: [columns[k]?.numeric ? 'numeric' : '', value?.tone || ''].join(' ').trim() || null,
      },
      inner,
    );
  };
  return h(
    'div',
    {
      class: 'scroll',
      tabindex: 0,
      role: 'region',
      'aria-label': caption || columns.map(c => c.label).join(', '),
    },
    h(
      'table',
      {class: 'plain'},
      caption ? h('caption', {}, caption) : null,
      h(
        'thead',
        {},
        h(
          'tr',
          {},
          columns.map(c => h('th', {scope: 'col', class: c.numeric ? 'numeric' : null}, c.label)),
        ),
      ),
      h(
        'tbody',
        {},
        rows.map(row => h('tr', {}, row.map(cell))),
      ),
    ),
  );
}
