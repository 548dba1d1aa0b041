// What a page counts itself, as filters change it: intervals and bins; and places in lists.

/** Wilson's 95 % interval of a share found in n trials. */
function wilson(p, n) {
  const z = 1.959963984540054;
  const zz = (z * z) / n;
  const middle = (p + zz / 2) / (1 + zz);
  const half = (z / (1 + zz)) * Math.sqrt((p * (1 - p)) / n + zz / n / 4);
  return [Math.max(0, middle - half), Math.min(1, middle + half)];
}

/** The same over strata, [{successes, trials}], as experiments/statistics/intervals.h; [0, 1] of nothing. */
export function stratified(strata) {
  let won = 0;
  let trials = 0;
  let rate = 0;
  let within = 0;
  for (const s of strata) {
    won += s.successes;
    trials += s.trials;
    const p = (s.successes + 0.5) / (s.trials + 1);
    rate += s.trials * p;
    const m = s.trials;
    within += (m * p * (1 - p) * (m + 1) ** 2) / (m * m + m + 1);
  }
  if (!trials) return [0, 1];
  const effect = Math.min(1, within / (rate * (1 - rate / trials)));
  return wilson(won / trials, trials / effect);
}

/** Index of the last of ascending values that is at or before one; -1 where none is. */
export function lastAt(values, value) {
  let low = 0;
  let high = values.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (values[middle] <= value + 1e-9) low = middle + 1;
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
