// Light or dark as the system has it, and paper; colours that can be seen on all of them.

const root = document.documentElement;
const system = matchMedia('(prefers-color-scheme: dark)');
const listeners = new Set();
let isPrinting = false;

export const kPaper_px = 690; // the width of a plot on A4

export const isDark = () => root.dataset.theme === 'dark';
/** While the page is being printed: what is drawn then is drawn at once, or it comes too late. */
export const isOnPaper = () => isPrinting;
/** Calls listener() whenever colours change; returns what ends that. */
export const onTheme = listener => {
  listeners.add(listener);
  return () => listeners.delete(listener);
};

function apply() {
  root.dataset.theme = system.matches && !isPrinting ? 'dark' : 'light';
  for (const listener of listeners) listener();
}

export function startTheme() {
  system.addEventListener('change', apply);
  for (const [event, on] of [
    ['beforeprint', true],
    ['afterprint', false],
  ])
    addEventListener(event, () => {
      isPrinting = on;
      apply();
    });
  apply();
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

/** Whether dark letters are read better on this colour [r, g, b] than light ones. */
export const isLight = rgb => luminance(rgb) > 0.18;

/** The colour [r, g, b] as CSS, lighter or darker until it stands out from the plot's ground. */
const known = new Map();
export function ink(rgb, opacity = 1, least = 3.1) {
  const key = `${rgb}|${isDark()}|${least}`;
  if (!known.has(key)) {
    const ground = luminance(isDark() ? [19, 28, 36] : [255, 255, 255]);
    const towards = isDark() ? 255 : 0;
    let color = rgb;
    for (let step = 0; step < 20 && contrast(luminance(color), ground) < least; ++step)
      color = color.map(c => c + (towards - c) * 0.09);
    known.set(key, color.map(Math.round).join(' '));
  }
  return `rgb(${known.get(key)} / ${opacity})`;
}

/** Colours of curves in their order, told apart without red and green, too: the program's. */
let curves = [];
export const setCurves = list => (curves = list);
export const curve = i => curves[i % curves.length];
