// An axis of a plot: how far it goes, where its values stand, and which of them are written at it.

import {roundStep} from 'page/numbers.js';

/**
 * [low, high] of an axis: what its model says and, of the rest, what holds all values, with a margin. `visit(hold)`
 * calls hold(value) for each.
 */
export function span({low, high, names = [], logarithmic} = {}, visit, margin) {
  if (names.length) return [low ?? -0.6, high ?? names.length - 0.4];
  if (Number.isFinite(low) && Number.isFinite(high)) return [low, high];
  let least = Infinity;
  let most = -Infinity;
  visit(value => {
    if (!Number.isFinite(value) || (logarithmic && value <= 0)) return;
    if (value < least) least = value;
    if (value > most) most = value;
  });
  if (least > most) [least, most] = logarithmic ? [0.1, 1] : [0, 1];
  if (logarithmic) return [low ?? least / 1.15, high ?? most * 1.15];
  const room = (most - least || Math.abs(most) || 1) * margin;
  return [low ?? least - room, high ?? most + room];
}

const clamp = (x, low, high) => Math.min(Math.max(x, low), high);

/** Values from low to high on pixels between two ends. */
export class Scale {
  /** axis: of the panel's model. */
  constructor([low, high], from, to, {logarithmic, whole, clamped} = {}) {
    Object.assign(this, {low, high, from, to, logarithmic, whole, clamped});
    this.a = logarithmic ? Math.log(low) : low;
    this.b = logarithmic ? Math.log(high) : high;
    if (this.a === this.b) this.b = this.a + 1;
  }
  of(x) {
    const value = this.logarithmic ? Math.log(Math.max(x, 1e-300)) : x;
    const share = (value - this.a) / (this.b - this.a);
    // what lies beyond stands at the edge
    return this.from + (this.clamped ? clamp(share, 0.01, 0.99) : share) * (this.to - this.from);
  }
  back(p) {
    const value = this.a + ((p - this.from) / (this.to - this.from)) * (this.b - this.a);
    return this.logarithmic ? Math.exp(value) : value;
  }

  /** Round values that are written, about one in so many pixels. */
  ticks(every_px) {
    const low = Math.min(this.low, this.high);
    const high = Math.max(this.low, this.high);
    if (this.logarithmic) return logTicks(low, high);
    const least = (high - low) / Math.max(1, Math.abs(this.to - this.from) / every_px);
    const step = this.whole ? Math.ceil(roundStep(least)) : roundStep(least);
    const list = [];
    for (let i = Math.ceil(low / step - 1e-9); i * step <= high + step * 1e-9; ++i)
      list.push(i * step);
    return list;
  }
}

/** 1, 2, 5 times powers of ten, or only those where there would be too many. */
function logTicks(low, high) {
  const powers = [];
  for (let power = Math.floor(Math.log10(low)); power <= Math.log10(high); ++power)
    powers.push(10 ** power);
  const within = list => list.filter(value => value >= low * 0.999 && value <= high * 1.001);
  const all = within(powers.flatMap(power => [power, 2 * power, 5 * power]));
  return all.length > 7 ? within(powers) : all;
}
