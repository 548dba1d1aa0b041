// A table of many rows: only those in view are elements. It filters and sorts.

import {h, button, fill, soon} from 'page/dom.js';
import {shown} from 'page/format.js';
import {plainTable} from 'page/parts.js';

const kRow_px = 30;
const kHead_px = 64;
const kHeight_px = 380;
const kPrinted = {rows: 12, columns: 9}; // on paper: the first rows, all columns, so many in a table

export class Table {
  /**
   * columns: [{key, label, title, width, value(row) → number, text or null, text(row) as it is shown, isNumeric,
   * choices: [text] for a filter of words}]; rows: how many; label: what they are; onPick(row), onFound(rows).
   */
  constructor(host, columns, rows, {label, onPick, onFound}) {
    Object.assign(this, {columns, rows, label, onPick, onFound});
    this.filters = new Map();
    this.only = null; // {rows: a Set, why}, from outside
    this.sort = {column: null, isDown: false};
    this.count = h('p', {class: 'note', role: 'status'});
    this.reset = button('Clear filters', () => this.clear());
    this.body = h('div', {class: 'rows', role: 'rowgroup'});
    const heads = h(
      'div',
      {class: 'row', role: 'row'},
      columns.map(column => this.head(column)),
    );
    const widths = columns.map(c => c.width || (c.isNumeric ? '96px' : '150px')).join(' ');
    this.scroll = h(
      'div',
      {
        class: 'table-scroll',
        tabindex: 0,
        role: 'table',
        'aria-label': label,
        'aria-rowcount': rows + 1,
        style: {maxHeight: `${kHeight_px}px`},
      },
      h('div', {class: 'table-head', role: 'rowgroup'}, heads),
      this.body,
    );
    this.scroll.style.setProperty('--columns', widths);
    host.append(h('div', {class: 'line'}, this.count, this.reset), this.scroll);
    const drawSoon = soon(() => this.draw());
    this.scroll.addEventListener('scroll', drawSoon);
    new ResizeObserver(drawSoon).observe(this.scroll);
    this.printed = h('div', {class: 'column'});
    host.append(this.printed);
    addEventListener('beforeprint', () => this.print());
    addEventListener('afterprint', () => fill(this.printed));
    this.update();
  }

  head(column) {
    const {label, title, choices, isNumeric} = column;
    const set = () => this.filter(column.key, column.field.value);
    column.field = choices
      ? h(
          'select',
          {onchange: set},
          h('option', {value: ''}, 'all'),
          choices.map(text => h('option', {value: text}, text)),
        )
      : h('input', {
          type: 'search',
          size: 4,
          spellcheck: 'false',
          placeholder: isNumeric ? '> 5' : 'text',
          title: isNumeric ? 'such as 12, > 5, <= 0.3' : 'rows that have this text',
          oninput: set,
        });
    column.field.setAttribute('aria-label', `filter ${label}`);
    const arrow = h('span', {class: 'arrow', 'aria-hidden': 'true'});
    const sort = button([label, arrow], () => this.sortBy(column), {
      class: 'sort',
      title: title || `sort by ${label}`,
    });
    column.head = h(
      'div',
      {class: isNumeric ? 'cell numeric' : 'cell', role: 'columnheader', 'aria-sort': 'none'},
      sort,
      column.field,
    );
    return column.head;
  }

  /** A filter from outside or from the column's own field; '' for none. */
  filter(key, text) {
    const column = this.columns.find(c => c.key === key);
    if (column.field.value !== text) column.field.value = text;
    const test = testOf(column, text.trim());
    column.field.classList.toggle('wrong', test === undefined);
    test ? this.filters.set(key, test) : this.filters.delete(key);
    this.update();
  }
  /** Only these rows, said as `why`. */
  restrict(rows, why) {
    this.only = {rows: new Set(rows), why};
    this.update();
  }
  clear() {
    this.only = null;
    this.filters.clear();
    for (const {field} of this.columns) {
      field.value = '';
      field.classList.remove('wrong');
    }
    this.update();
  }

  sortBy(column) {
    const isDown = this.sort.column === column && !this.sort.isDown;
    this.sort.column?.head.setAttribute('aria-sort', 'none');
    column.head.setAttribute('aria-sort', isDown ? 'descending' : 'ascending');
    this.sort = {column, isDown};
    this.update();
  }

  update() {
    const {only, rows} = this;
    const tests = [...this.filters.values()];
    if (only) tests.unshift(row => only.rows.has(row));
    const found = [];
    for (let row = 0; row < rows; ++row) if (tests.every(test => test(row))) found.push(row);
    if (this.sort.column) found.sort(orderOf(this.sort));
    this.found = found;
    const isAll = found.length === rows;
    this.reset.hidden = isAll && !only;
    const count = isAll ? rows : `${found.length} of ${rows}`;
    const label = rows === 1 ? this.label.replace(/s$/, '') : this.label;
    const why = only ? `: ${only.why}` : '';
    fill(this.count, `${count} ${label}${why}. Click one to see it.`);
    this.scroll.scrollTop = 0;
    this.draw();
    this.onFound(found);
  }

  /** Tables as wide as the paper, each beginning with the first column. */
  print() {
    const [first, ...others] = this.columns;
    const rows = this.found.slice(0, kPrinted.rows);
    const text = (column, row) => (column.text ? column.text(row) : shown(column.value(row)));
    for (let from = 0; from < others.length; from += kPrinted.columns) {
      const columns = [first, ...others.slice(from, from + kPrinted.columns)];
      const cells = rows.map(row => columns.map(column => text(column, row)));
      const labels = columns.map(({label, isNumeric}) => ({label, numeric: isNumeric}));
      this.printed.append(plainTable({columns: labels, rows: cells}));
    }
    if (rows.length < this.found.length)
      this.printed.append(
        h('p', {class: 'note'}, `The first ${rows.length} of ${this.found.length} rows.`),
      );
  }

  /** The rows in view. */
  draw() {
    const first = Math.max(0, Math.floor((this.scroll.scrollTop - kHead_px) / kRow_px) - 4);
    const drawn = this.found.slice(first, first + Math.ceil(kHeight_px / kRow_px) + 10);
    this.body.style.height = `${this.found.length * kRow_px}px`;
    fill(
      this.body,
      drawn.map((row, k) => this.rowElement(row, first + k)),
    );
  }
  rowElement(row, place) {
    return h(
      'div',
      {
        class: `row${this.picked === row ? ' picked' : ''}`,
        role: 'row',
        'aria-rowindex': place + 2,
        style: {transform: `translateY(${place * kRow_px}px)`},
        onclick: () => this.pick(row),
      },
      this.columns.map((column, k) => {
        const text = column.text ? column.text(row) : shown(column.value(row));
        return h(
          'div',
          {class: column.isNumeric ? 'cell numeric' : 'cell', role: 'cell', title: text},
          k === 0 ? button(text, null, {class: 'link', title: `show ${text}`}) : text,
        );
      }),
    );
  }
  pick(row) {
    this.picked = row;
    this.draw();
    this.onPick(row);
  }
}

/** By a column's values; rows without one come last. */
function orderOf({column, isDown}) {
  const sign = isDown ? -1 : 1;
  return (a, b) => {
    const x = column.value(a) ?? null;
    const y = column.value(b) ?? null;
    if (x === y) return a - b;
    if (x === null || y === null) return x === null ? 1 : -1;
    return x < y ? -sign : sign;
  };
}

const kTests = {
  '<': (v, limit) => v < limit,
  '<=': (v, limit) => v <= limit,
  '>': (v, limit) => v > limit,
  '>=': (v, limit) => v >= limit,
  '=': (v, limit) => v === limit,
};

/** row → whether it passes; null for no filter, undefined for one that says nothing. */
function testOf(column, text) {
  if (!text) return null;
  if (column.choices) return row => column.value(row) === text;
  if (!column.isNumeric) {
    const of = row => String((column.text ? column.text(row) : column.value(row)) ?? '');
    return row => of(row).toLowerCase().includes(text.toLowerCase());
  }
  const limit = text.match(/^(<=|>=|<|>|=)?\s*(-?[\d.]+(?:e-?\d+)?)$/i);
  if (!limit) return undefined;
  const test = kTests[limit[1] || '='];
  return row => (column.value(row) ?? null) !== null && test(column.value(row), Number(limit[2]));
}
