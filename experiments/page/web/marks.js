// The marks of a plot's series on its canvas: bands, columns, lines, bars, dots. `c` is the canvas's context,
// X and Y are the axes as Scale; y, low and high of a series may have gaps.

import {ink, isDark} from 'page/theme.js';

const finite = Number.isFinite;

/** Draws a series by its mark, which may be of several parts: "line_with_bars". */
export function drawSeries(c, series, X, Y) {
  const mark = series.mark || 'line';
  c.lineWidth = series.width || 1.6;
  c.strokeStyle = c.fillStyle = ink(series.color);
  c.lineJoin = 'round';
  if (mark === 'columns') return drawColumns(c, series, X, Y);
  if (mark.endsWith('band')) drawBand(c, series, X, Y);
  if (mark.startsWith('line') || mark.includes('dashes') || mark.includes('steps'))
    drawLine(c, series, mark, X, Y);
  if (mark.endsWith('bars') || mark === 'bars_along_x') drawBars(c, series, mark, X, Y);
  if (mark.includes('dots') || mark.includes('bars') || mark === 'rings')
    drawDots(c, series, mark, X, Y);
}

function drawBand(c, {x, low, high, color}, X, Y) {
  c.fillStyle = ink(color, 0.2);
  let run = [];
  const close = () => {
    if (run.length > 1) {
      c.beginPath();
      run.forEach((i, k) => c[k ? 'lineTo' : 'moveTo'](X.of(x[i]), Y.of(low[i])));
      run.reverse().forEach(i => c.lineTo(X.of(x[i]), Y.of(high[i])));
      c.fill();
    }
    run = [];
  };
  for (let i = 0; i < x.length; ++i) finite(low[i]) && finite(high[i]) ? run.push(i) : close();
  close();
  c.fillStyle = ink(color);
}

function drawColumns(c, {x, y, low, high, color}, X, Y) {
  const zero = Y.of(Math.max(0, Y.low));
  c.fillStyle = ink(color, 0.75);
  for (let i = 0; i < x.length; ++i) {
    const a = X.of(low[i]);
    const b = X.of(high[i]);
    c.fillRect(a + 0.5, Y.of(y[i]), Math.max(1, b - a - 1), zero - Y.of(y[i]));
  }
}

/** At most four points a column of pixels, however many there are. */
function drawLine(c, {x, y}, mark, X, Y) {
  c.setLineDash(mark.startsWith('dash') ? [7, 4] : []);
  const steps = mark.includes('steps');
  c.beginPath();
  let pen = false;
  let column = NaN;
  let least = 0;
  let most = 0;
  let last = 0;
  const flush = () => {
    // what else there is in this column of pixels
    if (!finite(column) || least === most) return;
    c.lineTo(column, least);
    c.lineTo(column, most);
    c.lineTo(column, last);
  };
  for (let i = 0; i < x.length; ++i) {
    if (!finite(x[i]) || !finite(y[i])) {
      flush();
      pen = false;
      column = NaN;
      continue;
    }
    const px = X.of(x[i]);
    const py = Y.of(y[i]);
    if (!pen) {
      c.moveTo(px, py);
      pen = true;
      column = NaN;
      if (!finite(y[i + 1])) {
        c.rect(px - 2, py - 2, 4, 4);
        c.moveTo(px, py);
      } // alone: a line would not show
    }
    if (finite(column) && Math.abs(px - column) < 0.5) {
      least = Math.min(least, py);
      most = Math.max(most, py);
      last = py;
      continue;
    }
    flush();
    if (steps && finite(column)) c.lineTo(px, last);
    c.lineTo(px, py);
    column = px;
    least = most = last = py;
  }
  flush();
  c.stroke();
  c.setLineDash([]);
}

function drawBars(c, {x, y, low, high, width}, mark, X, Y) {
  c.lineWidth = Math.min(2, width || 1.6);
  for (let i = 0; i < x.length; ++i) {
    if (!finite(x[i]) || !finite(y[i]) || !finite(low[i])) continue;
    const px = X.of(x[i]);
    const py = Y.of(y[i]);
    c.beginPath();
    if (mark === 'bars_along_x') {
      const a = X.of(low[i]);
      const b = X.of(high[i]);
      c.moveTo(a, py);
      c.lineTo(b, py);
      c.moveTo(a, py - 4);
      c.lineTo(a, py + 4);
      c.moveTo(b, py - 4);
      c.lineTo(b, py + 4);
    } else {
      const a = Y.of(low[i]);
      const b = Y.of(high[i]);
      c.moveTo(px, a);
      c.lineTo(px, b);
      c.moveTo(px - 4, a);
      c.lineTo(px + 4, a);
      c.moveTo(px - 4, b);
      c.lineTo(px + 4, b);
    }
    c.stroke();
  }
}

function drawDots(c, series, mark, X, Y) {
  const {x, y} = series;
  const dot = (series.dot || 6) / 2;
  const rings = mark === 'rings';
  const many = x.length > 2000; // squares: circles would take ten times as long
  const between = series.scale && mixer(series.scale);
  for (let i = 0; i < x.length; ++i) {
    if (!finite(x[i]) || !finite(y[i])) continue;
    const px = X.of(x[i]);
    const py = Y.of(y[i]);
    if (between) c.fillStyle = between(series.shade[i]);
    if (many) {
      c[rings ? 'strokeRect' : 'fillRect'](px - dot, py - dot, 2 * dot, 2 * dot);
      continue;
    }
    c.beginPath();
    c.arc(px, py, rings ? dot + 1 : dot, 0, 2 * Math.PI);
    rings ? c.stroke() : c.fill();
  }
}

/** share → colour between the two of a scale. */
function mixer({low, high, from, to}) {
  return value => {
    const share = Math.min(1, Math.max(0, (value - low) / (high - low || 1)));
    return ink(from.map((c, k) => c + (to[k] - c) * share).map(Math.round), 1, isDark() ? 2 : 1.5);
  };
}
