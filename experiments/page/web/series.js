// The rows of a trial, column by column. They may grow.

import {bytesOf} from 'page/data.js';
import {lastAt} from 'page/numbers.js';

/** Columns by name, {time_s: [...], ...}, of what the program packed (experiments/trial/series.h: Bytes), as base64. */
function unpack(base64) {
  const bytes = bytesOf(base64);
  const line = bytes.indexOf(10);
  const {rows, columns} = JSON.parse(new TextDecoder().decode(bytes.subarray(0, line)));
  let at = line + 1;
  const read = kind => {
    const width = Array.isArray(kind) ? 1 : 8;
    const whole = new Uint8Array(width * rows);
    for (let k = 0; k < width; ++k)
      for (let row = 0; row < rows; ++row) whole[row * width + k] = bytes[at++];
    if (Array.isArray(kind)) return Array.from(whole, place => kind[place]);
    const view = new DataView(whole.buffer);
    return Array.from({length: rows}, (_, row) =>
      kind === 'int' ? Number(view.getBigInt64(8 * row, true)) : view.getFloat64(8 * row, true),
    );
  };
  return Object.fromEntries(columns.map(([name, kind]) => [name, read(kind)]));
}

export class Series {
  /** packed: all its columns, of equal length. */
  constructor(packed) {
    this.columns = unpack(packed);
  }

  get length() {
    return (this.columns.time_s || []).length;
  }
  get end() {
    return this.length ? this.columns.time_s[this.length - 1] : 0;
  }

  /** Rows at the end, the same columns. */
  append(packed) {
    for (const [name, values] of Object.entries(unpack(packed))) {
      const own = (this.columns[name] ||= []);
      for (const value of values) own.push(value);
    }
  }

  /** Forgets the rows. */
  clear() {
    for (const name of Object.keys(this.columns)) this.columns[name] = [];
  }

  column(name) {
    return this.columns[name] || [];
  }
  at(name, i) {
    return i < 0 ? null : (this.columns[name]?.[i] ?? null);
  }

  /** The last row at or before a time; 0 before all, -1 without any. */
  indexAt(time) {
    const times = this.column('time_s');
    return times.length ? Math.max(0, lastAt(times, time)) : -1;
  }

  /** Pose of "est", "true", "true_at_image" or "vehicle" in a row as [x, y, z, qw, qx, qy, qz]; null if not there. */
  pose(which, i) {
    const pose = ['x_m', 'y_m', 'z_m', 'qw', 'qx', 'qy', 'qz'].map(part =>
      this.at(`${which}_${part}`, i),
    );
    return pose.some(value => !Number.isFinite(value)) ? null : pose;
  }
}

// Poses [x, y, z, qw, qx, qy, qz].
export function rotate([, , , w, x, y, z], [a, b, c]) {
  const tx = 2 * (y * c - z * b);
  const ty = 2 * (z * a - x * c);
  const tz = 2 * (x * b - y * a);
  return [a + w * tx + y * tz - z * ty, b + w * ty + z * tx - x * tz, c + w * tz + x * ty - y * tx];
}
export function transform(pose, point) {
  const [a, b, c] = rotate(pose, point);
  return [a + pose[0], b + pose[1], c + pose[2]];
}
export function compose(A, B) {
  const [w, x, y, z] = A.slice(3);
  const [v, a, b, c] = B.slice(3);
  return [
    ...transform(A, B),
    w * v - x * a - y * b - z * c,
    w * a + x * v + y * c - z * b,
    w * b - x * c + y * v + z * a,
    w * c + x * b - y * a + z * v,
  ];
}
export function inverse(A) {
  const q = [0, 0, 0, A[3], -A[4], -A[5], -A[6]];
  return [...rotate(q, A).map(x => -x), ...q.slice(3)];
}
