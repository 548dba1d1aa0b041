// The trials of a batch, column by column, as the program packed them (experiments/page/batch_page.h).

const kServed = /^(final_error_estimated|overshoot|tracking_rms|insertion_depth)_/; // noise where none began to servo

export class Trials {
  constructor({rows, columns, parameters, names}) {
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
}
