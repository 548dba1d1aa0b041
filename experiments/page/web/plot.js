// One plot of a panel: the model of experiments/report/plot.h as JSON (README.md: the model of a plot). Drawn on a
// canvas, so that ten thousand points and growing traces stay cheap.

import {h, button, fill, soon} from 'page/dom.js';
import {number} from 'page/format.js';
import {drawSeries, isAlongX} from 'page/marks.js';
import {lastAt} from 'page/numbers.js';
import {listen} from 'page/pointing.js';
import {Scale, span} from 'page/scale.js';
import {ink, isLight, isOnPaper, kPaper_px, onTheme, variable} from 'page/theme.js';

/** What plots of the same x axis share: the part that is shown, and the cursor. */
export class Sync {
  /** onSeek(x): the user points at an x; without, pointing shows the nearest point. */
  constructor(onSeek = null) {
    this.range = null; // [low, high], null for all
    this.cursor = null; // an x
    this.listeners = new Set();
    this.onSeek = onSeek;
  }
  setRange(range) {
    this.range = range;
    this.tell();
  }
  setCursor(x) {
    if (x === this.cursor) return;
    this.cursor = x;
    this.tell();
  }
  seek(x) {
    this.setCursor(x);
    this.onSeek(x);
  }
  tell() {
    for (const listener of this.listeners) listener();
  }
}

const kPaperHeight = 0.8; // of that on the screen
const finite = Number.isFinite;

export class Plot {
  /**
   * panel: the model. options: {height, label: what a screen reader says, sync: shared with plots above and below,
   * which keep the same margins, readout(series, index) → text of a point, onPick(series, index)}.
   */
  constructor(host, panel, options = {}) {
    this.options = options;
    this.hidden = new Set(); // names of series
    this.sync = options.sync || new Sync();
    this.height = options.height || 250;
    this.canvas = h('canvas', {
      tabindex: 0,
      role: 'img',
      style: {height: `${this.height}px`},
    });
    this.legend = h('div', {class: 'line legend'});
    this.title = h('div', {class: 'plot-title'});
    this.tip = h('div', {class: 'tip', hidden: true, 'aria-hidden': 'true'});
    this.element = h(
      'div',
      {class: 'plot'},
      h('div', {class: 'line'}, this.title, this.legend),
      h('div', {class: 'plot-ground'}, this.canvas, this.tip),
    );
    host.append(this.element);
    this.draw = soon(() => this.drawNow());
    this.set(panel);
    this.sync.listeners.add(this.draw);
    onTheme(() => (isOnPaper() ? this.drawNow() : this.draw()));
    new ResizeObserver(this.draw).observe(this.canvas);
    listen(this);
  }

  /** Another model, or the same after it grew. */
  set(panel) {
    this.panel = panel;
    fill(this.title, panel.title || '');
    const names = [...new Set(panel.series.map(series => series.name).filter(Boolean))];
    if (names.join('|') !== this.names?.join('|')) this.setLegend(names);
    const axes = `${panel.y?.label || 'values'} over ${panel.x?.label || 'x'}`;
    const shows = names.length ? `showing ${names.join(', ')}` : '';
    const label = [panel.title, axes, shows].filter(Boolean).join(': ');
    this.canvas.setAttribute('aria-label', this.options.label || label);
    this.draw();
  }

  setLegend(names) {
    this.names = names;
    fill(
      this.legend,
      names.map(name => {
        const {mark, opacity} = this.panel.series.find(series => series.name === name);
        const parts = [
          h('span', {class: `swatch ${mark}${opacity < 1 ? ' faint' : ''}`}),
          h('span', {}, name),
          this.sync.onSeek ? h('span', {class: 'value'}) : null,
        ];
        const toggle = () => {
          this.hidden.has(name) ? this.hidden.delete(name) : this.hidden.add(name);
          chip.setAttribute('aria-pressed', String(!this.hidden.has(name)));
          this.draw();
        };
        const title = `show or hide ${name}`;
        const chip = button(parts, toggle, {class: 'chip', title, pressed: true});
        return chip;
      }),
    );
  }

  /** Colours of the legend and, on plots with a time, the values at the cursor. */
  showLegend() {
    const at = this.sync.cursor;
    this.names.forEach((name, k) => {
      const chip = this.legend.children[k];
      const series = this.panel.series.find(s => s.name === name);
      chip.style.setProperty('--color', ink(series.color));
      if (!this.sync.onSeek) return;
      const isRead = finite(at) && series.mark !== 'band' && !(series.opacity < 1);
      const y = isRead ? series.y[lastAt(series.x, at)] : NaN;
      const value = finite(y) ? number(y, 3) : '';
      if (chip.lastChild.textContent !== value) chip.lastChild.textContent = value;
    });
  }

  shownSeries() {
    return this.panel.series.filter(series => !this.hidden.has(series.name));
  }

  /** Names of rules stand at the right. */
  namedRules() {
    return (this.panel.rules || []).filter(rule => !rule.is_up && rule.name);
  }

  /** All that the x axis could show. */
  fullRange() {
    const visit = hold => {
      for (const series of this.shownSeries()) {
        series.x.forEach(hold);
        if (isAlongX(series)) [...(series.low || []), ...(series.high || [])].forEach(hold);
      }
    };
    return span(this.panel.x, visit, 0.03);
  }

  /** What the left or the second y axis shows of the part [from, to] of x. */
  yRange(isSecond, [from, to]) {
    const visit = hold => {
      for (const series of this.shownSeries()) {
        if (Boolean(series.second) !== isSecond) continue;
        const {x, y, low, high} = series;
        const hasSpan = low && !isAlongX(series);
        for (let i = 0; i < x.length; ++i) {
          if (x[i] < from || x[i] > to) continue;
          hold(y[i]);
          if (!hasSpan) continue;
          hold(low[i]);
          hold(high[i]);
        }
      }
      if (!isSecond)
        for (const rule of this.panel.rules || []) if (!rule.is_up && rule.name) hold(rule.at);
    };
    return span(isSecond ? this.panel.y2 : this.panel.y, visit, this.panel.equal ? 0.2 : 0.07);
  }

  drawNow() {
    const {canvas, panel} = this;
    const width = isOnPaper() ? kPaper_px : canvas.clientWidth;
    const height = isOnPaper() ? kPaperHeight * this.height : canvas.clientHeight;
    if (!width || !height) return;
    const ratio = isOnPaper() ? 3 : Math.min(3, devicePixelRatio || 1);
    const size = {width: Math.round(width * ratio), height: Math.round(height * ratio)};
    if (canvas.width !== size.width || canvas.height !== size.height) Object.assign(canvas, size);
    const c = (this.c = canvas.getContext('2d'));
    c.setTransform(ratio, 0, 0, ratio, 0, 0);
    c.clearRect(0, 0, width, height);
    c.font = '12px system-ui, sans-serif';
    c.textBaseline = 'middle';
    this.width = width;
    this.layOut(width, height);
    this.clipped(0, () => (panel.blocks || []).forEach(block => this.drawBlock(block)));
    if (panel.has_axes !== false) {
      this.drawY();
      this.drawX(height);
    }
    this.clipped(2, () => this.drawInside());
    c.textAlign = 'left';
    for (const rule of this.namedRules()) {
      const y = this.Y.of(rule.at);
      c.fillStyle = ink(rule.color, 1, 4.6);
      if (y >= this.box.top - 1 && y <= this.box.bottom + 1)
        c.fillText(rule.name, this.box.right + 4, y);
    }
    this.showLegend();
  }

  /** Where the axes are, with room for what is written at them. */
  layOut(width, height) {
    const {panel} = this;
    const {x = {}, y = {}, y2 = {}} = panel;
    const hasAxes = panel.has_axes !== false;
    const isAligned = this.options.sync && !y.names?.length;
    const isSecond = panel.series.some(series => series.second);
    const widest = texts => Math.max(0, ...texts.map(text => this.c.measureText(text).width));
    const range = this.sync.range || this.fullRange();
    const top = 6;
    const bottom = height - (hasAxes ? this.roomBelow(x, width, widest) : 2);
    this.Y = new Scale(this.yRange(false, range), bottom, top, y);
    this.Y2 = isSecond ? new Scale(this.yRange(true, range), bottom, top, y2) : this.Y;
    this.yTicks = y.names?.length ? [] : this.Y.ticks(32);
    const texts = y.names?.length ? y.names : this.yTicks.map(value => number(value));
    const room = Math.min(width * 0.42, widest(texts) + 10 + (y.label ? 18 : 0));
    const names = this.namedRules().map(rule => rule.name);
    const left = isAligned ? 58 : hasAxes ? room : 0;
    const second = y2.label ? 62 : 46;
    const right = width - (isAligned ? 56 : isSecond ? second : Math.max(8, widest(names) + 8));
    this.box = {left, right, top, bottom};
    this.X = new Scale(range, left, right, x);
    if (panel.equal) this.makeEqual();
  }
  /** Widens the axis on which a length is drawn longer. */
  makeEqual() {
    const perPixel = ({low, high, from, to}) => (high - low) / Math.abs(to - from);
    const scale = Math.max(perPixel(this.X), perPixel(this.Y));
    const widened = axis => {
      const {low, high, from, to} = axis;
      const half = (scale * Math.abs(to - from)) / 2;
      return new Scale([(low + high) / 2 - half, (low + high) / 2 + half], from, to, axis);
    };
    this.X = widened(this.X);
    this.Y = this.Y2 = widened(this.Y);
    this.yTicks = this.Y.ticks(32);
  }
  /** Height of what stands below the x axis; nothing does in a stack but at its end. */
  roomBelow({names, label}, width, widest) {
    if (this.options.sync && !label) return 8;
    if (!names?.length) return label ? 38 : 22;
    const most = widest(names);
    this.isTurned = most > (width - 60) / names.length - 6;
    return (this.isTurned ? Math.min(110, 14 + most * 0.62) : 22) + (label ? 16 : 0);
  }

  /** Draws inside the axes, or a little beyond them. */
  clipped(margin, draw) {
    const {c, box} = this;
    c.save();
    c.beginPath();
    c.rect(
      box.left,
      box.top - margin,
      box.right - box.left + margin / 2,
      box.bottom - box.top + 2 * margin,
    );
    c.clip();
    draw();
    c.restore();
  }
  /** A line through the whole plot: up at an x of the canvas, or across at a y. */
  line(x, y) {
    const {c, box} = this;
    c.beginPath();
    c.moveTo(x ?? box.left, y ?? box.top);
    c.lineTo(x ?? box.right, y ?? box.bottom);
    c.stroke();
  }
  /** Text that is cut to fit, about a place, turned by an angle. */
  text(text, x, y, room, align, angle = 0) {
    const {c} = this;
    let shown = text;
    while (shown.length > 4 && c.measureText(shown).width > room)
      shown = shown.slice(0, -2).trimEnd() + '…';
    c.save();
    c.textAlign = align;
    c.translate(x, y);
    c.rotate(angle);
    c.fillText(shown, 0, 0);
    c.restore();
  }

  drawY() {
    const {c, panel, box, Y, Y2} = this;
    c.fillStyle = variable('faint');
    c.strokeStyle = variable('grid');
    c.lineWidth = 1;
    const write = (text, y) => this.text(text, box.left - 6, y, box.left - 6, 'right');
    (panel.y?.names || []).forEach((name, i) => {
      write(name, Y.of(i));
      this.line(null, Math.round(Y.of(i)) + 0.5);
    });
    for (const value of this.yTicks) {
      const y = Math.round(Y.of(value)) + 0.5;
      this.line(null, y);
      write(number(value), y);
    }
    if (Y2 !== Y)
      for (const value of Y2.ticks(40))
        this.text(number(value), box.right + 5, Y2.of(value), 40, 'left');
    c.fillStyle = variable('soft');
    const upright = (text, x) =>
      this.text(text, x, (box.top + box.bottom) / 2, box.bottom - box.top, 'center', -Math.PI / 2);
    if (panel.y?.label) upright(panel.y.label, 9);
    if (Y2 !== Y && panel.y2?.label && !this.options.sync) upright(panel.y2.label, box.right + 55);
  }

  drawX(height) {
    const {c, box, X} = this;
    const {names = [], label} = this.panel.x || {};
    const isWritten = label || !this.options.sync;
    c.fillStyle = variable('faint');
    names.forEach((name, i) => {
      const x = X.of(i);
      if (x < box.left - 1 || x > box.right + 1) return;
      if (this.isTurned) this.text(name, x + 4, box.bottom + 8, 150, 'right', -0.65);
      else this.text(name, x, box.bottom + 12, 150, 'center');
    });
    for (const value of names.length ? [] : X.ticks(85)) {
      const x = Math.round(X.of(value)) + 0.5;
      const most = this.width - c.measureText(number(value)).width / 2;
      this.line(x, null);
      if (isWritten) this.text(number(value), Math.min(x, most), box.bottom + 12, 85, 'center');
    }
    c.fillStyle = variable('soft');
    if (label)
      this.text(label, (box.left + box.right) / 2, height - 8, box.right - box.left, 'center');
  }

  drawBlock({from_x, to_x, from_y, to_y, color, opacity = 1, name}) {
    const {c, X, Y, box} = this;
    const [a, b] = [
      finite(from_x) ? X.of(from_x) : box.left,
      finite(to_x) ? X.of(to_x) : box.right,
    ];
    const [low, high] = [
      finite(from_y) ? Y.of(from_y) : box.bottom,
      finite(to_y) ? Y.of(to_y) : box.top,
    ];
    c.fillStyle = ink(color, opacity, opacity < 1 ? 1.6 : 1);
    c.fillRect(a, high, b - a, low - high);
    if (!name || Math.abs(b - a) <= c.measureText(name).width + 6) return;
    c.fillStyle = opacity < 1 ? variable('ink') : isLight(color) ? '#10161b' : '#fff';
    const middle = (Math.max(Math.min(a, b), box.left) + Math.min(Math.max(a, b), box.right)) / 2;
    this.text(name, middle, (low + high) / 2, Infinity, 'center');
  }

  drawInside() {
    const {c, panel, sync, box, X, Y, Y2, drag} = this;
    for (const rule of panel.rules || []) {
      if (rule.mark === 'none') continue;
      c.strokeStyle = ink(rule.color, 0.9);
      c.lineWidth = rule.width || 1.2;
      c.setLineDash(rule.mark === 'dashes' ? [6, 4] : []);
      rule.is_up ? this.line(X.of(rule.at), null) : this.line(null, Y.of(rule.at));
    }
    c.setLineDash([]);
    this.shownSeries().forEach((series, k) => {
      c.lineDashOffset = 4 * k; // where curves coincide, each has dashes of its own
      drawSeries(c, series, X, series.second ? Y2 : Y);
    });
    c.strokeStyle = variable('accent');
    c.lineWidth = 1;
    if (finite(sync.cursor)) this.line(X.of(sync.cursor), null);
    c.fillStyle = variable('accent');
    c.globalAlpha = 0.16;
    if (drag) c.fillRect(drag.from, box.top, drag.to - drag.from, box.bottom - box.top);
    c.globalAlpha = 1;
  }
}
