// One plot of a panel: the model of experiments/media/plot.h as JSON (README.md: the model of a plot).
// Drawn on a canvas, so that ten thousand points and growing traces stay cheap.

import {h, fill} from 'page/dom.js';
import {number} from 'page/format.js';
import {drawSeries} from 'page/marks.js';
import {lastAt} from 'page/numbers.js';
import {Scale, logTicks, ticks} from 'page/scale.js';
import {ink, onTheme, variable} from 'page/theme.js';

/** What plots of the same x axis share: the part that is shown, and the cursor. */
export class Sync {
  constructor() {
    this.range = null; // [low, high], null for all
    this.cursor = null; // an x
    this.listeners = new Set();
    this.onSeek = null; // called with an x that the user points at
  }
  setRange(range) {
    this.range = range;
    this.tell();
  }
  setCursor(x) {
    if (x !== this.cursor) {
      this.cursor = x;
      this.tell();
    }
  }
  seek(x) {
    this.setCursor(x);
    this.onSeek?.(x);
  }
  tell() {
    for (const listener of this.listeners) listener();
  }
}

const finite = Number.isFinite;
const kFont = '12px system-ui, sans-serif';

export class Plot {
  /**
   * panel: the model. options: {height, sync, label, onPick(series, index), compact: no x axis, left, right: margins,
   * readout: (series, index) => text}.
   */
  constructor(host, panel, options = {}) {
    this.options = options;
    this.hidden = new Set();
    this.sync = options.sync || new Sync();
    this.canvas = h('canvas', {
      tabindex: 0,
      role: 'img',
      style: {height: `${options.height || 240}px`},
    });
    this.legend = h('div', {class: 'legend'});
    this.title = h('div', {class: 'plot-title'});
    this.tip = h('div', {class: 'tip', hidden: true, 'aria-hidden': 'true'});
    this.element = h(
      'div',
      {class: 'plot'},
      h('div', {class: 'plot-head'}, this.title, this.legend),
      h('div', {class: 'plot-ground'}, this.canvas, this.tip),
    );
    host.append(this.element);
    this.set(panel);
    this.sync.listeners.add(() => this.draw());
    onTheme(() => this.draw());
    new ResizeObserver(() => this.draw()).observe(this.canvas);
    this.listen();
  }

  /** Another model, or the same after it grew. */
  set(panel) {
    this.panel = panel;
    this.drawLegend();
    this.describe();
    this.draw();
  }

  describe() {
    const names = this.panel.series.map(series => series.name).filter(Boolean);
    this.canvas.setAttribute(
      'aria-label',
      this.options.label ||
        [
          this.panel.title,
          `${this.panel.y?.label || 'values'} over ${this.panel.x?.label || 'x'}`,
          names.length ? `showing ${names.join(', ')}` : '',
        ]
          .filter(Boolean)
          .join(': '),
    );
  }

  drawLegend() {
    fill(this.title, this.panel.title || '');
    this.values = new Map();
    const names = [...new Set(this.panel.series.map(series => series.name).filter(Boolean))];
    if (names.join('|') === this.legendNames) return this.collectValues();
    this.legendNames = names.join('|');
    fill(
      this.legend,
      names.map(name => {
        const series = this.panel.series.find(s => s.name === name);
        const chip = h(
          'button',
          {
            type: 'button',
            class: 'chip',
            'aria-pressed': String(!this.hidden.has(name)),
            title: `show or hide ${name}`,
            onclick: () => {
              this.hidden.has(name) ? this.hidden.delete(name) : this.hidden.add(name);
              chip.setAttribute('aria-pressed', String(!this.hidden.has(name)));
              this.draw();
            },
          },
          h('span', {class: `swatch ${series.mark}`}),
          h('span', {}, name),
          h('span', {class: 'value'}),
        );
        chip.dataset.name = name;
        return chip;
      }),
    );
    this.collectValues();
  }
  collectValues() {
    for (const chip of this.legend.children) {
      const series = this.panel.series.find(s => s.name === chip.dataset.name);
      if (series) this.values.set(chip.dataset.name, chip.querySelector('.value'));
      if (series) chip.style.setProperty('--color', ink(series.color));
    }
  }

  shownSeries() {
    return this.panel.series.filter(series => !this.hidden.has(series.name));
  }

  fullRange(axis, second = false) {
    const spec = (second ? this.panel.y2 : this.panel[axis]) || {};
    const names = spec.names || [];
    const low = finite(spec.low) ? spec.low : null;
    const high = finite(spec.high) ? spec.high : null;
    if (names.length) return [low ?? -0.6, high ?? names.length - 0.4];
    if (low !== null && high !== null) return [low, high];
    let least = Infinity;
    let most = -Infinity;
    const hold = value => {
      if (!finite(value) || (spec.logarithmic && value <= 0)) return;
      if (value < least) least = value;
      if (value > most) most = value;
    };
    const [x0, x1] = axis === 'y' ? this.xRange() : [-Infinity, Infinity];
    for (const series of this.shownSeries()) {
      if (axis === 'y' && Boolean(series.second) !== second) continue;
      const along = ['bars_along_x', 'columns'].includes(series.mark) ? 'x' : 'y'; // low and high are of it
      for (let i = 0; i < series.x.length; ++i) {
        if (axis === 'y' && (series.x[i] < x0 || series.x[i] > x1)) continue;
        hold(series[axis][i]);
        if (axis === along && series.low) {
          hold(series.low[i]);
          hold(series.high[i]);
        }
      }
    }
    if (axis === 'y' && !second)
      for (const rule of this.panel.rules || []) if (!rule.up && rule.name) hold(rule.at);
    if (least > most) [least, most] = spec.logarithmic ? [0.1, 1] : [0, 1];
    if (spec.logarithmic) return [low ?? least / 1.15, high ?? most * 1.15];
    const margin = (most - least || Math.abs(most) || 1) * (axis === 'x' ? 0.03 : 0.07);
    const span = [low ?? least - margin, high ?? most + margin];
    if (finite(spec.least_span) && span[1] - span[0] < spec.least_span) {
      if (low !== null) return [low, low + spec.least_span];
      const middle = (span[0] + span[1]) / 2;
      return [middle - spec.least_span / 2, middle + spec.least_span / 2];
    }
    return span;
  }
  xRange() {
    return this.sync.range || this.fullRange('x');
  }

  draw() {
    if (this.pending) return;
    this.pending = true;
    requestAnimationFrame(() => {
      this.pending = false;
      this.drawNow();
    });
  }

  drawNow() {
    const canvas = this.canvas;
    const width = canvas.clientWidth;
    const height = canvas.clientHeight;
    if (!width || !height) return;
    const ratio = Math.min(3, devicePixelRatio || 1);
    const w = Math.round(width * ratio);
    const t = Math.round(height * ratio);
    if (canvas.width !== w || canvas.height !== t) {
      canvas.width = w;
      canvas.height = t;
    }
    const c = (this.c = canvas.getContext('2d'));
    c.setTransform(ratio, 0, 0, ratio, 0, 0);
    c.clearRect(0, 0, width, height);
    c.font = kFont;
    this.layOut(width, height);
    const {panel, box, X, Y, Y2} = this;
    this.clipped(0, () => this.drawBlocks(c));
    c.lineWidth = 1;
    c.textBaseline = 'middle';
    if (panel.has_axes !== false) {
      this.drawY(c);
      this.drawX(c, width, height);
    }
    this.clipped(2, () => {
      for (const rule of panel.rules || []) if (rule.mark !== 'none') this.drawRule(c, rule);
      c.setLineDash([]);
      for (const series of this.shownSeries()) drawSeries(c, series, X, series.second ? Y2 : Y);
      if (finite(this.sync.cursor)) {
        c.strokeStyle = variable('accent');
        c.lineWidth = 1;
        this.upright(c, X.of(this.sync.cursor));
      }
      if (this.drag) {
        c.fillStyle = variable('select');
        c.fillRect(
          Math.min(this.drag.from, this.drag.to),
          box.top,
          Math.abs(this.drag.to - this.drag.from),
          box.bottom - box.top,
        );
      }
    });
    c.textAlign = 'left';
    for (const rule of this.namedRules()) {
      c.fillStyle = ink(rule.color, 1, 4.6);
      if (Y.of(rule.at) >= box.top - 1 && Y.of(rule.at) <= box.bottom + 1)
        c.fillText(rule.name, box.right + 4, Y.of(rule.at));
    }
    this.collectValues();
    if (this.options.values) this.showValues();
  }

  /** Where the axes are, with room for what is written at them. */
  layOut(width, height) {
    const {c, panel, options} = this;
    const hasAxes = panel.has_axes !== false;
    const names = panel.y?.names || [];
    const [y0, y1] = this.fullRange('y');
    const xs = this.xRange();
    const second = panel.series.some(series => series.second);
    const bottom = !hasAxes
      ? 2
      : options.compact
        ? 8
        : panel.x?.names?.length
          ? this.nameRoom(panel.x.names, width)
          : panel.x?.label
            ? 38
            : 22;
    this.yTicks = names.length
      ? []
      : panel.y?.logarithmic
        ? logTicks(y0, y1)
        : ticks(y0, y1, (height - bottom) / 32, panel.y?.whole);
    const widest = texts => Math.max(0, ...texts.map(text => c.measureText(text).width));
    const room = widest(names.length ? names : this.yTicks.map(value => number(value)));
    const left =
      options.left ?? (hasAxes ? Math.min(width * 0.42, room + 10 + (panel.y?.label ? 18 : 0)) : 0);
    const right =
      options.right ??
      (second ? 46 : Math.max(8, widest(this.namedRules().map(rule => rule.name)) + 8));
    const box = (this.box = {left, right: width - right, top: 6, bottom: height - bottom});
    this.X = new Scale(...xs, box.left, box.right, panel.x?.logarithmic);
    this.Y = new Scale(y0, y1, box.bottom, box.top, panel.y?.logarithmic);
    this.Y2 = second
      ? new Scale(...this.fullRange('y', true), box.bottom, box.top, panel.y2?.logarithmic)
      : this.Y;
  }
  /** Rules whose names stand at the right: there is no legend. */
  namedRules() {
    return (this.panel.rules || []).filter(
      rule => !rule.up && rule.name && this.panel.legend === 'none',
    );
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
  upright(c, x) {
    c.beginPath();
    c.moveTo(x, this.box.top);
    c.lineTo(x, this.box.bottom);
    c.stroke();
  }
  level(c, y) {
    c.beginPath();
    c.moveTo(this.box.left, y);
    c.lineTo(this.box.right, y);
    c.stroke();
  }

  drawY(c) {
    const {panel, box, Y, Y2} = this;
    c.fillStyle = variable('faint');
    c.strokeStyle = variable('grid');
    c.textAlign = 'right';
    (panel.y?.names || []).forEach((name, i) =>
      this.text(c, name, box.left - 6, Y.of(i), box.left - 6),
    );
    for (const value of this.yTicks) {
      const y = Math.round(Y.of(value)) + 0.5;
      this.level(c, y);
      c.fillText(number(value), box.left - 6, y);
    }
    c.textAlign = 'left';
    if (Y2 !== Y)
      for (const value of ticks(Y2.low, Y2.high, this.canvas.clientHeight / 40))
        c.fillText(number(value), box.right + 5, Y2.of(value));
    if (!panel.y?.label) return;
    c.fillStyle = variable('soft');
    c.textAlign = 'center';
    c.save();
    c.translate(9, (box.top + box.bottom) / 2);
    c.rotate(-Math.PI / 2);
    this.text(c, panel.y.label, 0, 0, box.bottom - box.top);
    c.restore();
  }

  drawX(c, width, height) {
    const {panel, box, X} = this;
    const compact = this.options.compact;
    c.fillStyle = variable('faint');
    c.strokeStyle = variable('grid');
    if (panel.x?.names?.length) {
      if (!compact) this.drawNames(c, panel.x.names, X, box);
      return;
    }
    c.textAlign = 'center';
    for (const value of panel.x?.logarithmic
      ? logTicks(X.low, X.high)
      : ticks(X.low, X.high, (box.right - box.left) / 85, panel.x?.whole)) {
      const x = Math.round(X.of(value)) + 0.5;
      this.upright(c, x);
      if (!compact)
        c.fillText(
          number(value),
          Math.min(x, width - c.measureText(number(value)).width / 2),
          box.bottom + 12,
        );
    }
    c.fillStyle = variable('soft');
    if (panel.x?.label && !compact)
      this.text(c, panel.x.label, (box.left + box.right) / 2, height - 8, box.right - box.left);
  }

  drawRule(c, rule) {
    c.strokeStyle = ink(rule.color, 0.9);
    c.lineWidth = rule.width || 1.2;
    c.setLineDash(rule.mark === 'dashes' ? [6, 4] : []);
    rule.up ? this.upright(c, this.X.of(rule.at)) : this.level(c, this.Y.of(rule.at));
  }

  text(c, text, x, y, room) {
    let shown = text;
    while (shown.length > 4 && c.measureText(shown).width > room)
      shown = shown.slice(0, -2).trimEnd() + '…';
    c.fillText(shown, x, y);
  }
  nameRoom(names, width) {
    this.c.font = kFont;
    const widest = Math.max(0, ...names.map(name => this.c.measureText(name).width));
    this.turned = widest > (width - 60) / names.length - 6;
    return this.turned ? Math.min(110, 14 + widest * 0.62) : 22;
  }
  drawNames(c, names, X, box) {
    names.forEach((name, i) => {
      const x = X.of(i);
      if (x < box.left - 1 || x > box.right + 1) return;
      if (!this.turned) {
        c.textAlign = 'center';
        c.fillText(name, x, box.bottom + 12);
        return;
      }
      c.save();
      c.translate(x + 4, box.bottom + 8);
      c.rotate(-0.65);
      c.textAlign = 'right';
      this.text(c, name, 0, 0, 150);
      c.restore();
    });
  }

  drawBlocks(c) {
    const {X, Y, box} = this;
    for (const block of this.panel.blocks || []) {
      const x0 = finite(block.x0) ? X.of(block.x0) : box.left;
      const x1 = finite(block.x1) ? X.of(block.x1) : box.right;
      const y0 = finite(block.y0) ? Y.of(block.y0) : box.bottom;
      const y1 = finite(block.y1) ? Y.of(block.y1) : box.top;
      c.fillStyle = block.fill || ink(block.color, block.opacity ?? 1, 1.6);
      c.fillRect(Math.min(x0, x1), Math.min(y0, y1), Math.abs(x1 - x0), Math.abs(y1 - y0));
      if (block.name && Math.abs(x1 - x0) > c.measureText(block.name).width + 6) {
        c.fillStyle = block.ink || (this.panel.has_axes === false ? '#fff' : variable('soft'));
        c.textAlign = 'center';
        c.textBaseline = 'middle';
        const mid =
          (Math.max(Math.min(x0, x1), box.left) + Math.min(Math.max(x0, x1), box.right)) / 2;
        c.fillText(block.name, mid, (y0 + y1) / 2);
      }
    }
  }

  /** The point nearest to a place on the canvas, at most so many pixels away: {series, i}, or null. */
  nearestPoint(px, py, reach = 24) {
    let best = null;
    let least = reach * reach;
    for (const series of this.shownSeries()) {
      if (['band', 'none'].includes(series.mark)) continue;
      const Y = series.second ? this.Y2 : this.Y;
      for (let i = 0; i < series.x.length; ++i) {
        if (!finite(series.x[i]) || !finite(series.y[i])) continue;
        const x = this.X.of(series.x[i]);
        if (series.mark === 'columns') {
          if (px >= this.X.of(series.low[i]) && px < this.X.of(series.high[i]) && series.y[i] > 0)
            return {series, i};
          continue;
        }
        const d = (x - px) ** 2 + (Y.of(series.y[i]) - py) ** 2;
        if (d < least) {
          least = d;
          best = {series, i};
        }
      }
    }
    return best;
  }

  /** Values at the cursor, in the legend. */
  showValues() {
    const at = this.sync.cursor;
    for (const series of this.panel.series) {
      const place = this.values.get(series.name);
      if (!place) continue;
      const i = finite(at) ? lastAt(series.x, at) : -1;
      const value =
        i >= 0 && series.mark !== 'band' && finite(series.y[i]) ? number(series.y[i], 3) : '';
      if (place.textContent !== value) place.textContent = value;
    }
  }

  describePoint({series, i}) {
    if (this.options.readout) return this.options.readout(series, i);
    const panel = this.panel;
    const names = panel.x?.names || [];
    const yNames = panel.y?.names || [];
    const x = names.length ? names[Math.round(series.x[i])] : number(series.x[i]);
    const y = yNames.length ? yNames[Math.round(series.y[i])] : number(series.y[i]);
    const unit = label => (label ? `${label} ` : '');
    const span =
      series.low && finite(series.low[i])
        ? ` [${number(series.low[i], 3)}, ${number(series.high[i], 3)}]`
        : '';
    return [series.name, `${unit(panel.x?.label)}${x}`, `${unit(panel.y?.label)}${y}${span}`]
      .filter(Boolean)
      .join('\n');
  }
  showTip(found) {
    this.tip.hidden = !found;
    this.canvas.style.cursor = found && this.options.onPick ? 'pointer' : '';
    if (!found) return;
    this.tip.textContent = this.describePoint(found);
    const Y = found.series.second ? this.Y2 : this.Y;
    const x = this.X.of(found.series.x[found.i]);
    const y = Y.of(found.series.y[found.i]);
    const width = this.tip.offsetWidth;
    const height = this.tip.offsetHeight;
    this.tip.style.left = `${Math.max(0, Math.min(x + 12, this.canvas.clientWidth - width))}px`;
    this.tip.style.top = `${y > height + 16 ? y - height - 10 : y + 14}px`;
  }

  zoom(factor, around) {
    const [low, high] = this.xRange();
    const at = around ?? this.sync.cursor ?? (low + high) / 2;
    const [least, most] = this.fullRange('x');
    const next = [
      Math.max(least, at - (at - low) * factor),
      Math.min(most, at + (high - at) * factor),
    ];
    this.sync.setRange(next[0] <= least && next[1] >= most ? null : next);
  }

  listen() {
    const canvas = this.canvas;
    const place = event => {
      const r = canvas.getBoundingClientRect();
      return [event.clientX - r.left, event.clientY - r.top];
    };
    const inside = ([x]) => this.box && x >= this.box.left - 8 && x <= this.box.right + 8;
    canvas.addEventListener('pointerdown', event => {
      const at = place(event);
      if (event.button || !this.X || !inside(at)) return;
      this.drag = {from: at[0], to: at[0], touch: event.pointerType === 'touch'};
      if (!this.drag.touch) canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener('pointermove', event => {
      if (!this.X) return;
      const at = place(event);
      if (this.drag) this.drag.to = Math.min(Math.max(at[0], this.box.left), this.box.right);
      else if (this.options.points) this.showTip(this.nearestPoint(...at));
      if (this.options.values && inside(at) && (!this.drag || this.drag.touch))
        this.sync.seek(this.X.back(at[0]));
      if (this.drag) this.draw();
    });
    const end = event => {
      if (!this.drag) return;
      const {from, to, touch} = this.drag;
      const at = place(event);
      this.drag = null;
      if (Math.abs(to - from) > 8 && !touch) {
        const [a, b] = [this.X.back(from), this.X.back(to)];
        this.sync.setRange([Math.min(a, b), Math.max(a, b)]);
      } else if (event.type === 'pointerup') {
        const found = this.options.points && this.nearestPoint(...at);
        if (found) {
          this.showTip(found);
          this.options.onPick?.(found.series, found.i);
        } else if (this.options.values) this.sync.seek(this.X.back(at[0]));
        else this.options.onBackground?.(this.X.back(at[0]), this.Y.back(at[1]));
      }
      this.draw();
    };
    canvas.addEventListener('pointerup', end);
    canvas.addEventListener('pointercancel', end);
    canvas.addEventListener('pointerleave', () => {
      if (!this.drag) this.showTip(null);
    });
    canvas.addEventListener('dblclick', () => this.sync.setRange(null));
    canvas.addEventListener(
      'wheel',
      event => {
        if (!event.ctrlKey && !event.shiftKey) return; // the page scrolls
        event.preventDefault();
        this.zoom(Math.exp((event.deltaY || event.deltaX) * 0.002), this.X.back(place(event)[0]));
      },
      {passive: false},
    );
    canvas.addEventListener('keydown', event => this.key(event));
  }

  /** Arrows move the cursor or the picked point, + and - zoom, 0 shows all, Enter picks. */
  key(event) {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const step = event.shiftKey ? 10 : 1;
    const move = by => {
      const series = this.shownSeries().find(s => s.x.length && s.mark !== 'none');
      if (!series) return;
      if (this.options.points) {
        this.picked = Math.min(Math.max((this.picked ?? -1) + by, 0), series.x.length - 1);
        this.showTip({series, i: this.picked});
        this.tip.setAttribute('aria-hidden', 'false');
      } else {
        const [low, high] = this.xRange();
        const at = (this.sync.cursor ?? low) + (by * (high - low)) / 200;
        this.sync.seek(Math.min(Math.max(at, low), high));
      }
    };
    const actions = {
      ArrowRight: () => move(step),
      ArrowLeft: () => move(-step),
      '+': () => this.zoom(0.7),
      '=': () => this.zoom(0.7),
      '-': () => this.zoom(1.4),
      0: () => this.sync.setRange(null),
      Home: () => this.sync.seek(this.xRange()[0]),
      End: () => this.sync.seek(this.xRange()[1]),
      Enter: () => {
        const series = this.shownSeries().find(s => s.x.length && s.mark !== 'none');
        if (this.options.points && series && this.picked !== undefined)
          this.options.onPick?.(series, this.picked);
      },
    };
    if (!actions[event.key]) return;
    event.preventDefault();
    actions[event.key]();
  }
}
