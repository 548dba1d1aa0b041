// An axis of a plot: where its values stand, and which of them are written at it.

/** Round numbers from low to high, about `count`; or whole ones only. */
export function ticks(low, high, count, whole = false) {
  if (!(high > low)) return [low];
  const raw = Math.max((high - low) / Math.max(1, count), whole ? 1 : 0);
  const power = 10 ** Math.floor(Math.log10(raw));
  const isRound = step => step >= raw * 0.999 && (!whole || Number.isInteger(step));
  const step = [1, 2, 2.5, 5, 10].map(f => f * power).find(isRound) || 10 * power;
  const list = [];
  for (let i = Math.ceil(low / step - 1e-9); i * step <= high + step * 1e-9; ++i)
    list.push(i * step);
  return list.map(value => (Math.abs(value) < step * 1e-9 ? 0 : value));
}

/** The same of a logarithmic axis: 1, 2, 5, or powers of ten where those are too many. */
export function logTicks(low, high) {
  const list = [];
  for (let power = Math.floor(Math.log10(low)); power <= Math.log10(high); ++power)
    for (const factor of [1, 2, 5]) {
      const value = factor * 10 ** power;
      if (value >= low * 0.999 && value <= high * 1.001) list.push(value);
    }
  return list.length > 7
    ? list.filter(value => String(value / 10 ** Math.floor(Math.log10(value) + 1e-9))[0] === '1')
    : list;
}

/** Values from low to high on pixels between two ends. */
export class Scale {
  constructor(low, high, from, to, logarithmic) {
    Object.assign(this, {low, high, from, to, logarithmic});
    this.a = logarithmic ? Math.log(low) : low;
    this.b = logarithmic ? Math.log(high) : high;
    if (this.a === this.b) this.b = this.a + 1;
  }
  of(x) {
    const value = this.logarithmic ? Math.log(Math.max(x, 1e-300)) : x;
    return this.from + ((value - this.a) / (this.b - this.a)) * (this.to - this.from);
  }
  back(p) {
    const value = this.a + ((p - this.from) / (this.to - this.from)) * (this.b - this.a);
    return this.logarithmic ? Math.exp(value) : value;
  }
}
