// A table of many rows: only those in view are elements. It filters and sorts.

import {h, fill} from 'page/dom.js';
import {number} from 'page/format.js';

const kRow_px = 30;

/**
 * columns: [{key, label, title, value(i) → number | text | null, text(i), numeric, choices: [text] for a
 * filter of words}], rows: how many. options: {onPick(i), label, height, action: what a click does}.
 */
export class Table {
  constructor(host, columns, rows, options = {}) {
    Object.assign(this, {columns, rows, options});
    this.filters = new Map();
    this.only = null; // a Set of rows, from outside
    this.sort = {key: null, down: false};
    this.count = h('p', {class: 'note', role: 'status'});
    this.reset = h('button', {type: 'button', onclick: () => this.clear()}, 'Clear filters');
    this.heads = columns.map(column => this.head(column));
    this.body = h('div', {class: 'rows', role: 'rowgroup'});
    this.scroll = h(
      'div',
      {
        class: 'table-scroll',
        tabindex: 0,
        role: 'table',
        'aria-label': options.label || 'table',
        'aria-rowcount': rows + 1,
        style: {maxHeight: `${options.height || 420}px`},
      },
      h(
        'div',
        {class: 'table-head', role: 'rowgroup'},
        h('div', {class: 'row', role: 'row'}, this.heads),
      ),
      this.body,
    );
    this.element = h(
      'div',
      {
        class: 'table',
        style: {'--columns': columns.map(c => c.width || (c.numeric ? '96px' : '150px')).join(' ')},
      },
      h('div', {class: 'table-bar'}, this.count, this.reset),
      this.scroll,
    );
    this.scroll.style.setProperty(
      '--columns',
      columns.map(c => c.width || (c.numeric ? '96px' : '150px')).join(' '),
    );
    host.append(this.element);
    this.scroll.addEventListener('scroll', () => this.drawSoon());
    new ResizeObserver(() => this.drawSoon()).observe(this.scroll);
    addEventListener('beforeprint', () => this.draw(60));
    addEventListener('afterprint', () => this.draw());
    this.scroll.addEventListener('keydown', event => this.key(event));
    this.update();
  }

  head(column) {
    const sort = h(
      'button',
      {
        type: 'button',
        class: 'sort',
        title: column.title || `sort by ${column.label}`,
        onclick: () => this.sortBy(column.key),
      },
      column.label,
      h('span', {class: 'arrow', 'aria-hidden': 'true'}),
    );
    const filter = column.choices
      ? h(
          'select',
          {
            'aria-label': `filter ${column.label}`,
            onchange: () => this.filter(column.key, filter.value),
          },
          h('option', {value: ''}, 'all'),
          column.choices.map(text => h('option', {value: text}, text)),
        )
      : h('input', {
          type: 'search',
          'aria-label': `filter ${column.label}`,
          size: 4,
          spellcheck: 'false',
          placeholder: column.numeric ? '> 5' : 'text',
          title: column.numeric ? 'such as 12, > 5, <= 0.3, 2..4' : 'rows that have this text',
          oninput: () => this.filter(column.key, filter.value),
        });
    column.filterElement = filter;
    const cell = h(
      'div',
      {class: column.numeric ? 'cell numeric' : 'cell', role: 'columnheader', 'aria-sort': 'none'},
      sort,
      filter,
    );
    column.headElement = cell;
    return cell;
  }

  /** A filter from outside or from the column's own field; '' for none. */
  filter(key, text) {
    const column = this.columns.find(c => c.key === key);
    if (!column) return;
    if (column.filterElement.value !== text) column.filterElement.value = text;
    const test = testOf(column, text.trim());
    column.filterElement.classList.toggle('wrong', test === undefined);
    test ? this.filters.set(key, test) : this.filters.delete(key);
    this.update();
  }
  /** Only these rows (a Set), said as `why`; null for all. */
  restrict(rows, why) {
    this.only = rows;
    this.why = why;
    this.update();
  }
  clear() {
    this.only = null;
    this.filters.clear();
    for (const column of this.columns) {
      column.filterElement.value = '';
      column.filterElement.classList.remove('wrong');
    }
    this.update();
    this.options.onClear?.();
  }

  sortBy(key) {
    this.sort = {key, down: this.sort.key === key && !this.sort.down};
    for (const column of this.columns)
      column.headElement.setAttribute(
        'aria-sort',
        column.key !== key ? 'none' : this.sort.down ? 'descending' : 'ascending',
      );
    this.update();
  }

  update() {
    const found = [];
    rows: for (let i = 0; i < this.rows; ++i) {
      if (this.only && !this.only.has(i)) continue;
      for (const test of this.filters.values()) if (!test(i)) continue rows;
      found.push(i);
    }
    const column = this.columns.find(c => c.key === this.sort.key);
    if (column) {
      const sign = this.sort.down ? -1 : 1;
      found.sort((a, b) => {
        const x = column.value(a);
        const y = column.value(b);
        if (x === null || x === undefined || y === null || y === undefined)
          return (x ?? null) === (y ?? null) ? a - b : (x ?? null) === null ? 1 : -1; // nothing comes last
        return x < y ? -sign : x > y ? sign : a - b;
      });
    }
    this.found = found;
    const all = found.length === this.rows;
    this.reset.hidden = all && !this.only;
    this.count.textContent =
      (all ? `${this.rows} trials` : `${found.length} of ${this.rows} trials`) +
      (this.only && this.why ? `: ${this.why}` : '') +
      (this.options.action ? `. ${this.options.action}` : '');
    this.scroll.scrollTop = 0;
    this.draw();
    this.options.onFound?.(found);
  }

  drawSoon() {
    if (this.pending) return;
    this.pending = true;
    requestAnimationFrame(() => {
      this.pending = false;
      this.draw();
    });
  }
  draw(most) {
    const head = 64;
    const first = Math.max(0, Math.floor((this.scroll.scrollTop - head) / kRow_px) - 4);
    const room = most || Math.ceil((this.options.height || 420) / kRow_px) + 10;
    const shown = this.found.slice(first, first + room);
    this.body.style.height = `${(most ? shown.length : this.found.length) * kRow_px}px`;
    fill(
      this.body,
      shown.map((row, k) => this.rowElement(row, first + k)),
    );
  }
  rowElement(row, place) {
    const picks = this.options.onPick;
    return h(
      'div',
      {
        class: `row${this.picked === row ? ' picked' : ''}`,
        role: 'row',
        'aria-rowindex': place + 2,
        style: {transform: `translateY(${place * kRow_px}px)`},
        onclick: picks ? () => this.pick(row) : null,
      },
      this.columns.map((column, k) => {
        const text = column.text ? column.text(row) : cellText(column.value(row));
        const inner =
          k === 0 && picks
            ? h('button', {type: 'button', class: 'link', title: `show trial ${text}`}, text)
            : text;
        return h(
          'div',
          {
            class: column.numeric ? 'cell numeric' : 'cell',
            role: 'cell',
            title: column.title ? null : text,
          },
          inner,
        );
      }),
    );
  }
  pick(row) {
    this.picked = row;
    this.draw();
    this.options.onPick?.(row);
  }
  key(event) {
    if (event.target !== this.scroll) return;
    const by = {ArrowDown: 1, ArrowUp: -1}[event.key];
    if (!by || !this.options.onPick || !this.found.length) return;
    event.preventDefault();
    const at = this.found.indexOf(this.picked);
    const next = Math.min(Math.max(at + by, 0), this.found.length - 1);
    this.scroll.scrollTop = Math.max(0, next * kRow_px - 120);
    this.pick(this.found[next]);
  }
}

const cellText = value =>
  typeof value === 'number'
    ? number(value)
    : value === null || value === undefined
      ? '–'
      : String(value);

/** row → whether it passes; null for no filter, undefined for one that says nothing. */
function testOf(column, text) {
  if (!text) return null;
  if (column.choices) return i => column.value(i) === text;
  if (!column.numeric) {
    const part = text.toLowerCase();
    return i =>
      String((column.text ? column.text(i) : column.value(i)) ?? '')
        .toLowerCase()
        .includes(part);
  }
  const span = text.match(/^(-?[\d.]+)\s*\.\.\s*(-?[\d.]+)$/);
  const compare = text.match(/^(<=|>=|<|>|=)?\s*(-?[\d.]+(?:e-?\d+)?)$/i);
  const shown = i => (column.filterValue ? column.filterValue(i) : column.value(i));
  if (!span && !compare) return undefined;
  const limit = Number(compare?.[2]);
  const tests = {
    '<': v => v < limit,
    '<=': v => v <= limit,
    '>': v => v > limit,
    '>=': v => v >= limit,
    '=': v => v === limit,
  };
  const test = span ? v => v >= Number(span[1]) && v <= Number(span[2]) : tests[compare[1] || '='];
  return i => {
    const v = shown(i);
    return v !== null && v !== undefined && test(v);
  };
}
