// The marks of a plot's series on its canvas: bands, columns, lines, bars, dots. `c` is the canvas's context, X and Y
// are the axes as Scale; y, low and high of a series may have gaps.

import {ink} from 'page/theme.js';

const finite = Number.isFinite;

/** Draws a series by its mark, which may be of several parts: "line_with_bars". */
export function drawSeries(c, series, X, Y) {
  const {mark} = series;
  const is = (...words) => words.some(word => mark.includes(word));
  c.lineWidth = series.width || 1.6;
  c.globalAlpha = series.opacity ?? 1;
  c.strokeStyle = c.fillStyle = ink(series.color);
  c.lineJoin = 'round';
  if (is('columns')) drawColumns(c, series, X, Y);
  if (is('band')) drawBand(c, series, X, Y);
  if (is('line', 'dash')) drawLine(c, series, X, Y);
  if (is('bars')) drawBars(c, series, X, Y);
  if (is('dots', 'bars', 'rings')) drawDots(c, series, X, Y);
  c.globalAlpha = 1;
}

function drawBand(c, {x, low = [], high = [], color}, X, Y) {
  c.fillStyle = ink(color, 0.2);
  let run = [];
  const close = () => {
    c.beginPath();
    for (const i of run) c.lineTo(X.of(x[i]), Y.of(low[i]));
    for (const i of run.reverse()) c.lineTo(X.of(x[i]), Y.of(high[i]));
    c.fill();
    run = [];
  };
  for (let i = 0; i < x.length; ++i) finite(low[i]) && finite(high[i]) ? run.push(i) : close();
  close();
}

function drawColumns(c, {x, y, low, high, color}, X, Y) {
  const zero = Y.of(Math.max(0, Y.low));
  c.fillStyle = ink(color, 0.75);
  for (let i = 0; i < x.length; ++i) {
    const a = X.of(low[i]);
    c.fillRect(a + 0.5, Y.of(y[i]), Math.max(1, X.of(high[i]) - a - 1), zero - Y.of(y[i]));
  }
}

/** Of the points in a column of pixels only those that reach farther, however many there are. */
function drawLine(c, {x, y, mark}, X, Y) {
  c.setLineDash(mark.startsWith('dash') ? [7, 4] : []);
  c.beginPath();
  let column = NaN; // NaN: no line goes on
  let [least, most, last] = [0, 0, 0];
  for (let i = 0; i < x.length; ++i) {
    if (!finite(x[i]) || !finite(y[i])) {
      column = NaN;
      continue;
    }
    const px = X.of(x[i]);
    const py = Y.of(y[i]);
    if (!finite(column)) {
      if (!finite(y[i + 1])) c.rect(px - 2, py - 2, 4, 4); // alone: a line would not show
      c.moveTo(px, py);
    } else if (Math.abs(px - column) < 0.5 && py >= least && py <= most) {
      last = py;
      continue;
    } else {
      c.lineTo(px, py);
    }
    const isNew = !(Math.abs(px - column) < 0.5);
    least = isNew ? py : Math.min(least, py);
    most = isNew ? py : Math.max(most, py);
    if (isNew) column = px;
    last = py;
  }
  c.stroke();
  c.setLineDash([]);
}

/** Whether low and high are of x. */
export const isAlongX = ({mark}) => ['columns', 'bars_across'].includes(mark);

function drawBars(c, series, X, Y) {
  const {x, y, low, high, width} = series;
  const [along, off] = isAlongX(series) ? [X, Y] : [Y, X];
  c.lineWidth = Math.min(2, width || 1.6);
  c.beginPath();
  const line = (...points) => {
    const [from, to] = along === X ? points : points.map(([p, q]) => [q, p]);
    c.moveTo(...from);
    c.lineTo(...to);
  };
  for (let i = 0; i < x.length; ++i) {
    if (!finite(x[i]) || !finite(y[i]) || !finite(low?.[i])) continue;
    const at = off.of((along === X ? y : x)[i]);
    const ends = [along.of(low[i]), along.of(high[i])];
    line([ends[0], at], [ends[1], at]);
    for (const end of ends) line([end, at - 4], [end, at + 4]);
  }
  c.stroke();
}

function drawDots(c, {x, y, dot = 6, mark}, X, Y) {
  const isRing = mark === 'rings';
  const radius = dot / 2 + (isRing ? 1 : 0);
  const isMany = x.length > 2000; // squares: circles would take ten times as long
  for (let i = 0; i < x.length; ++i) {
    if (!finite(x[i]) || !finite(y[i])) continue;
    const px = X.of(x[i]);
    const py = Y.of(y[i]);
    if (isMany) {
      const box = [px - dot / 2, py - dot / 2, dot, dot];
      isRing ? c.strokeRect(...box) : c.fillRect(...box);
      continue;
    }
    c.beginPath();
    c.arc(px, py, radius, 0, 2 * Math.PI);
    isRing ? c.stroke() : c.fill();
  }
}
