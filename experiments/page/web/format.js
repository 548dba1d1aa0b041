// Numbers and names for people.

const kShown = [
  // a quantity's unit in its name, what is shown and by what it is multiplied
  ['_m', 'mm', 1000],
  ['_rad', '°', 180 / Math.PI],
  ['_s', 's', 1],
  ['_v', 'V', 1],
  ['_newton', 'N', 1],
  ['_mps', 'm/s', 1],
  ['_rad_s', '°/s', 180 / Math.PI],
  ['_joule', 'J', 1],
  ['_ml_m3', 'ml/m³', 1],
  ['_kg', 'kg', 1],
  ['_mm', 'mm', 1],
  ['_deg', '°', 1],
];

/** {label, unit, factor} of a column's name: "final_error_true_y_m" → "final error true y", "mm". */
export function quantity(name) {
  let best = null;
  for (const [ending, unit, factor] of kShown)
    if (name.endsWith(ending) && (!best || ending.length > best.ending.length))
      best = {ending, unit, factor};
  const label = best ? name.slice(0, -best.ending.length) : name;
  return {
    label: label.replaceAll('_', ' '),
    unit: best ? best.unit : '',
    factor: best ? best.factor : 1,
  };
}

/**
 * The same of a scenario's key, by its last word that is no index: "sea.current.surface_velocity_mps[1]" → "current
 * surface velocity y", "m/s". `with unit` for an axis or a column.
 */
export function parameter(key) {
  const index = key.match(/\[(\d)\]$/);
  const parts = key.replace(/\[\d+\]/g, '').split('.');
  const {label, unit, factor} = quantity(parts.pop());
  const axis = index ? ` ${'xyz'[index[1]] ?? index[1]}` : '';
  const group = parts.length ? `${words(parts.pop())} ` : '';
  return {label: group + label + axis, unit, factor};
}
export const titled = ({label, unit}) => (unit ? `${label}, ${unit}` : label);

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

/** A sentence of the program without the model's names of shapes: "hull_box" → "hull". */
export const spoken = sentence =>
  String(sentence ?? '').replace(/\b(hull|pole|station|dock|ball|marker)_\w+/g, '$1');

/** A value of any kind as text. */
export const shown = value =>
  typeof value === 'number'
    ? number(value)
    : value === null || value === undefined
      ? '–'
      : String(value);

export const clockText = seconds => `${fixed(Math.max(0, seconds), 1)} s`;
