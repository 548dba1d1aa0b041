// The trials of a batch, column by column, as the program packed them (experiments/page/batch_page.h).

import {groupsOf, stratified} from 'page/numbers.js';

const kServed = /^(final_error_estimated|overshoot|tracking_rms|insertion_depth)_/; // noise where none began to servo

export class Trials {
  constructor({rows, columns, parameters, names, grid = []}) {
    this.names = names; // key → {label, unit, factor to what is shown}
    this.rows = Array.from({length: rows}, (_, row) => row);
    this.get = {};
    for (const [key, column] of Object.entries({...columns, ...parameters})) {
      const isNoise = kServed.test(key);
      this.get[key] = row =>
        isNoise && columns.failure[row] === 'never_found' ? null : (column[row] ?? null);
    }
    this.parameters = Object.keys(parameters);
    this.columns = Object.keys(columns);
    this.planned = new Set(['case', 'stratum', ...grid]); // what tells cells or strata apart, not how trials went
    this.isSuccess = row => this.get.failure(row) === 'none';
  }

  isNumeric(key) {
    const first = this.rows.find(row => this.get[key](row) !== null);
    return first !== undefined && typeof this.get[key](first) === 'number';
  }

  /** Different values of a column, as a Set; or in order. */
  distinct(key) {
    const all = new Set(this.rows.map(this.get[key]));
    all.delete(null);
    return all;
  }
  values(key) {
    const all = [...this.distinct(key)];
    return this.isNumeric(key)
      ? all.sort((a, b) => a - b)
      : all.sort((a, b) => String(a).localeCompare(String(b), 'en', {numeric: true}));
  }

  /**
   * {won, all, share, low, high} of the rows that succeeded: the 95 % interval over the plan's strata, if it has any
   * and the rows are whole cells, told apart by these keys only.
   */
  rate(rows, keys) {
    const isWhole = this.get.stratum && keys.every(key => this.planned.has(key));
    const strata = groupsOf(rows, isWhole ? this.get.stratum : () => '');
    const counts = [...strata.values()].map(members => ({
      successes: members.filter(this.isSuccess).length,
      trials: members.length,
    }));
    const won = counts.reduce((sum, {successes}) => sum + successes, 0);
    const [low, high] = stratified(counts);
    return {won, all: rows.length, share: won / rows.length, low, high};
  }
}
