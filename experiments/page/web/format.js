// Numbers and names for people.

/** Of a quantity, {label, unit, factor}, for an axis or a column: "final error true y, mm". */
export const titled = ({label, unit}) => (unit ? `${label}, ${unit}` : label);

/** A value with its unit: "12 mm", but "5°". */
export const measured = (text, unit) => `${text}${!unit || unit.startsWith('°') ? '' : ' '}${unit}`;

/** A number in three or four digits, without needless zeros; "–" for none. */
export function number(x, digits = 4) {
  if (x === null || x === undefined || !Number.isFinite(x)) return '–';
  const size = Math.abs(x);
  if (size < 1e-9) return '0';
  if (size >= 1e6 || size < 1e-4) return x.toExponential(2).replace('e+', 'e');
  const decimals = Math.max(0, digits - 1 - Math.floor(Math.log10(size)));
  return String(Number(x.toFixed(Math.min(decimals, 6))));
}

export const fixed = (x, decimals) =>
  x === null || x === undefined || !Number.isFinite(x)
    ? '–'
    : (Object.is(Number(x.toFixed(decimals)), -0) ? 0 : x).toFixed(decimals);

export const percent = (x, decimals = 0) => `${fixed(100 * x, decimals)} %`;

/** "83 % [80, 86]" of a share with its interval. */
export const rate = (share, low, high) =>
  `${percent(share)} [${fixed(100 * low, 0)}, ${fixed(100 * high, 0)}]`;

export const words = name => String(name).replaceAll('_', ' ');

/** A sentence of the program without names of shapes, "hull_box" → "hull", and keys, "visual_servoing". */
export const spoken = sentence =>
  words(String(sentence ?? '').replace(/\b(hull|pole|station|dock|ball|marker)_\w+/g, '$1'));

/** A value of any kind as text. */
export const shown = value =>
  typeof value === 'number'
    ? number(value)
    : [null, undefined, ''].includes(value)
      ? '–'
      : String(value);

export const clockText = seconds =>
  Number.isFinite(seconds) ? `${fixed(Math.max(0, seconds), 1)} s` : '–';
