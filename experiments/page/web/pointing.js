// What mouse, finger and keys do on a plot: a point's values and what it opens, the cursor, the part that is shown.

import {number} from 'page/format.js';
import {isAlongX} from 'page/marks.js';

const finite = Number.isFinite;
const kReach_px = 24; // about a point

/** The point of a plot nearest to a place on its canvas: {series, i}, or null. */
function nearestPoint(plot, px, py) {
  let best = null;
  let least = kReach_px ** 2;
  for (const series of pointed(plot)) {
    const {x, y, low, high, mark} = series;
    const Y = series.second ? plot.Y2 : plot.Y;
    for (let i = 0; i < x.length; ++i) {
      if (!finite(x[i]) || !finite(y[i])) continue;
      const isIn = isAlongX(series) && px >= plot.X.of(low?.[i]) && px < plot.X.of(high?.[i]);
      const dx = isIn ? 0 : plot.X.of(x[i]) - px;
      const dy = isIn && mark === 'columns' ? 0 : Y.of(y[i]) - py;
      const d = dx ** 2 + dy ** 2;
      if (d >= least || (mark === 'columns' && !(isIn && y[i] > 0))) continue;
      least = d;
      best = {series, i};
    }
  }
  return best;
}

const pointed = plot =>
  plot.shownSeries().filter(({x, mark}) => x.length && !['band', 'none'].includes(mark));

/** The point so many steps after the one that was shown last, through all series. */
function pointAfter(plot, step) {
  const list = pointed(plot);
  const count = list.reduce((sum, series) => sum + series.x.length, 0);
  plot.at = Math.min(Math.max((plot.at ?? -1) + step, 0), count - 1);
  let i = plot.at;
  for (const series of list) {
    if (i < series.x.length) return {series, i};
    i -= series.x.length;
  }
  return null;
}

function describe({panel, options}, {series, i}) {
  if (options.readout) return options.readout(series, i);
  const value = (axis, v, digits) =>
    axis?.names?.length ? axis.names[Math.round(v)] : number(v, digits);
  const part = (axis, v) => `${axis?.label ? `${axis.label} ` : ''}${value(axis, v)}`;
  const {low, high} = series;
  const span = finite(low?.[i]) ? ` [${number(low[i], 3)}, ${number(high[i], 3)}]` : '';
  const [ofX, ofY] = isAlongX(series) ? [span, ''] : ['', span];
  const [at, is] = [part(panel.x, series.x[i]) + ofX, part(panel.y, series.y[i]) + ofY];
  return [series.name, at, is].filter(Boolean).join('\n');
}

/** Says what a point is; null: nothing. */
function show(plot, found) {
  const {tip, canvas, options} = plot;
  plot.found = found;
  tip.hidden = !found;
  canvas.style.cursor = found && options.onPick ? 'pointer' : '';
  if (!found) return;
  const {series, i} = found;
  tip.textContent = describe(plot, found);
  const x = plot.X.of(series.x[i]);
  const y = (series.second ? plot.Y2 : plot.Y).of(series.y[i]);
  const {offsetWidth: width, offsetHeight: height} = tip;
  tip.style.left = `${Math.max(0, Math.min(x + 12, canvas.clientWidth - width))}px`;
  tip.style.top = `${y > height + 16 ? y - height - 10 : y + 14}px`;
}

function pick(plot) {
  if (plot.found) plot.options.onPick?.(plot.found.series, plot.found.i);
}

export function listen(plot) {
  const {canvas, sync} = plot;
  const on = (name, act) =>
    canvas.addEventListener(name, event => plot.X && act(event, ...place(event)));
  const place = event => {
    const r = canvas.getBoundingClientRect();
    return [event.clientX - r.left, event.clientY - r.top];
  };
  const isInside = x => x >= plot.box.left - 8 && x <= plot.box.right + 8;

  on('pointerdown', (event, x) => {
    if (event.button || !isInside(x)) return;
    plot.drag = {from: x, to: x, isTouch: event.pointerType === 'touch'};
    if (!plot.drag.isTouch) canvas.setPointerCapture(event.pointerId);
  });
  on('pointermove', (event, x, y) => {
    if (plot.drag) plot.drag.to = Math.min(Math.max(x, plot.box.left), plot.box.right);
    else if (!sync.onSeek) show(plot, nearestPoint(plot, x, y));
    if (sync.onSeek && isInside(x) && (!plot.drag || plot.drag.isTouch)) sync.seek(plot.X.back(x));
    if (plot.drag) plot.draw();
  });
  const end = (event, x, y) => {
    if (!plot.drag) return;
    const {from, to, isTouch} = plot.drag;
    plot.drag = null;
    if (Math.abs(to - from) > 8 && !isTouch) {
      sync.setRange([from, to].map(p => plot.X.back(p)).sort((a, b) => a - b));
    } else if (event.type === 'pointerup') {
      if (sync.onSeek) sync.seek(plot.X.back(x));
      else {
        show(plot, nearestPoint(plot, x, y));
        pick(plot);
      }
    }
    plot.draw();
  };
  on('pointerup', end);
  on('pointercancel', end);
  on('pointerleave', () => plot.drag || show(plot, null));
  on('dblclick', () => sync.setRange(null));
  on('keydown', event => key(plot, event));
}

/** Arrows move the cursor or go from point to point, 0 shows all, Enter picks. */
function key(plot, event) {
  if (event.ctrlKey || event.altKey || event.metaKey) return;
  const {sync, X, tip} = plot;
  const seek = x => sync.onSeek && sync.seek(Math.min(Math.max(x, X.low), X.high));
  const move = step => {
    if (sync.onSeek) return seek((sync.cursor ?? X.low) + (step * (X.high - X.low)) / 200);
    show(plot, pointAfter(plot, step));
    tip.setAttribute('aria-hidden', 'false');
  };
  const many = event.shiftKey ? 10 : 1;
  const actions = {
    ArrowRight: () => move(many),
    ArrowLeft: () => move(-many),
    0: () => sync.setRange(null),
    Home: () => seek(X.low),
    End: () => seek(X.high),
    Enter: () => pick(plot),
  };
  if (!actions[event.key]) return;
  event.preventDefault();
  actions[event.key]();
}
