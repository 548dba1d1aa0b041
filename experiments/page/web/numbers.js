// What a page counts itself, as filters change it: bins and groups; and places in lists.

/** Index of the last of ascending times that is at or before one, which is told to a millisecond; -1 where none is. */
export function lastAt(values, value) {
  let low = 0;
  let high = values.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (values[middle] <= value + 2e-3) low = middle + 1;
    else high = middle;
  }
  return low - 1;
}

/** Rows by the value of get(row), in the order of their first appearance. */
export function groupsOf(rows, get) {
  const groups = new Map();
  for (const row of rows) {
    const value = get(row);
    const group = groups.get(value);
    group ? group.push(row) : groups.set(value, [row]);
  }
  return groups;
}

/** The least of 1, 2, 2.5, 5 and 10 times a power of ten that is no less than this. */
export function roundStep(least) {
  const power = 10 ** Math.floor(Math.log10(least || 1));
  return power * [1, 2, 2.5, 5, 10].find(factor => factor * power >= least * 0.999);
}

/** Rows in bins of equal, round width: [{low, high, rows}]. */
export function bins(rows, get, most) {
  if (!rows.length) return [];
  const values = rows.map(get);
  const low = values.reduce((a, b) => Math.min(a, b));
  const high = values.reduce((a, b) => Math.max(a, b));
  const count = Math.min(most, Math.max(4, Math.ceil(Math.sqrt(rows.length))));
  const width = roundStep((high - low) / count);
  const first = Math.floor(low / width);
  const list = Array.from({length: Math.floor(high / width) - first + 1}, (_, k) => ({
    low: (first + k) * width,
    high: (first + k + 1) * width,
    rows: [],
  }));
  rows.forEach((row, k) => list[Math.floor(values[k] / width) - first].rows.push(row));
  return list;
}
