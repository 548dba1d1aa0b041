// Light, dark and paper; colours that can be seen on all of them.

const root = document.documentElement;
const system = matchMedia('(prefers-color-scheme: dark)');
const listeners = new Set();
let printing = false;

const stored = () => {
  try {
    return localStorage.getItem('turbidock-theme');
  } catch {
    return null;
  }
};
export const isDark = () =>
  !printing && (root.dataset.theme ? root.dataset.theme === 'dark' : system.matches);
export const onTheme = listener => {
  listeners.add(listener);
  return () => listeners.delete(listener);
};
const tell = () => {
  for (const listener of listeners) listener();
};

export function startTheme() {
  if (stored()) root.dataset.theme = stored();
  system.addEventListener('change', tell);
  const print = on => () => {
    printing = on;
    root.classList.toggle('printing', on);
    tell();
  };
  addEventListener('beforeprint', print(true));
  addEventListener('afterprint', print(false));
}

export function toggleTheme() {
  root.dataset.theme = isDark() ? 'light' : 'dark';
  try {
    localStorage.setItem('turbidock-theme', root.dataset.theme);
  } catch {
    /* a private window */
  }
  tell();
}

/** A colour of page.css, such as variable('ink'). */
export const variable = name =>
  getComputedStyle(root)
    .getPropertyValue('--' + name)
    .trim();

const linear = c => (c <= 0.03928 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4);
const luminance = ([r, g, b]) =>
  0.2126 * linear(r / 255) + 0.7152 * linear(g / 255) + 0.0722 * linear(b / 255);
const contrast = (a, b) => (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);

/** The colour [r, g, b] as CSS, lighter or darker until it stands out from the plot's ground. */
const known = new Map();
export function ink(rgb, opacity = 1, least = 3.1) {
  const dark = isDark();
  const key = `${rgb}|${dark}|${least}`;
  if (!known.has(key)) {
    const ground = luminance(dark ? [19, 28, 36] : [255, 255, 255]);
    const towards = dark ? 255 : 0;
    let color = rgb;
    for (let step = 0; step < 20 && contrast(luminance(color), ground) < least; ++step)
      color = color.map(c => c + (towards - c) * 0.09);
    known.set(key, color.map(Math.round).join(' '));
  }
  return `rgb(${known.get(key)} / ${opacity})`;
}

/** Colours of curves in their order, told apart without red and green, too. */
export const kCurves = [
  [0, 114, 178],
  [213, 94, 0],
  [0, 158, 115],
  [204, 121, 167],
  [230, 159, 0],
  [86, 180, 233],
  [122, 79, 176],
  [70, 78, 86],
];
export const curve = i => kCurves[i % kCurves.length];
/** Good, bad, and neither. */
export const kTones = {good: [0, 138, 96], bad: [200, 62, 12], none: [110, 120, 130]};
