// The synchronised plots of one trial: F, x, y, z, yaw, voltages, speeds, forces.

import {h} from 'page/dom.js';
import {words} from 'page/format.js';
import {Plot, Sync} from 'page/plot.js';
import {yawOf} from 'page/series.js';
import {curve} from 'page/theme.js';

const kDeg = 180 / Math.PI;

/** Stages as spans of time: [{name, from, to, index}]. */
export function stageSpans(series, stages) {
  const times = series.column('time_s');
  const names = series.column('stage');
  const spans = [];
  for (let i = 0; i < times.length; ++i) {
    const last = spans[spans.length - 1];
    if (last) last.to = times[i];
    if (!last || last.name !== names[i])
      spans.push({name: names[i], from: times[i], to: times[i], index: stages.indexOf(names[i])});
  }
  return spans;
}

export class Traces {
  /** trial: the model; series: a Series; clock: a Clock that the cursor moves and follows. */
  constructor(host, trial, series, clock) {
    Object.assign(this, {trial, series, clock});
    this.sync = new Sync();
    this.sync.onSeek = time => {
      clock.pause();
      clock.follow = false;
      clock.seek(time);
    };
    // where the clock follows growing rows, the cursor moves with them: see update
    clock.on(() => {
      if (!(clock.follow && clock.playing)) this.sync.setCursor(clock.time);
    });
    this.hint = h(
      'p',
      {class: 'note hint'},
      'Point to see values, drag to zoom, double click (or 0) for all.',
    );
    const grid = h('div', {class: 'traces'});
    this.plots = this.panels().map(panel => {
      const plot = new Plot(grid, panel, {
        sync: this.sync,
        height: panel.height,
        values: true,
        compact: !panel.x.label,
        left: 58,
        right: 42,
        label: `${panel.title || panel.y.label} over time; arrow keys move the time`,
      });
      return plot;
    });
    host.append(grid, this.hint);
  }

  /** After the series grew. */
  update() {
    if (this.clock.follow) this.sync.cursor = this.clock.time;
    this.panels().forEach((panel, i) => this.plots[i].set(panel));
  }

  panels() {
    const {trial, series} = this;
    const colors = trial.colors;
    const limits = trial.limits;
    const time = series.column('time_s');
    const spans = stageSpans(series, trial.stages);
    const end = Math.max(time.length ? time[time.length - 1] : 0, 1);
    const x = {low: 0, high: end};
    const ground = spans.map(span => ({
      x0: span.from,
      x1: span.to,
      color: colors.stages[span.index] || [128, 128, 128],
      opacity: 0.1,
    }));
    const line = (name, y, color, more = {}) => ({
      name,
      x: time,
      y,
      color,
      mark: 'line',
      width: 1.5,
      ...more,
    });
    const fitness = series.column('fitness');
    const found = fitness.map(f => f >= limits.detection_fitness);
    const controlled = series.column('controlled');
    const list = (prefix, part, factor) => {
      const of = part === 'yaw' ? this.yaw(prefix) : series.column(`${prefix}_${part}_m`);
      return of.map(value => (Number.isFinite(value) ? value * factor : null));
    };
    const stageBar = {
      has_axes: false,
      x,
      y: {low: 0, high: 1},
      series: [],
      rules: [],
      height: 24,
      title: '',
      legend: 'none',
      blocks: spans.map(span => ({
        name: words(span.name),
        x0: span.from,
        x1: span.to,
        color: colors.stages[span.index] || [128, 128, 128],
        opacity: 1,
        fill: stageFill(colors.stages[span.index]),
        ink: '#10161b',
      })),
    };
    const panels = [
      {
        title: 'F',
        x,
        y: {low: fitness.reduce((least, f) => (f < least ? f : least), -0.25), high: 1.02},
        legend: 'none',
        blocks: ground,
        height: 112,
        series: [line('F', fitness, colors.estimate)],
        rules: [limits.docking_fitness, limits.detection_fitness].map(at => ({
          at,
          name: at.toFixed(2),
          color: colors.limit,
          mark: 'line',
        })),
      },
    ];
    const pose = (title, part, factor, band, least, rule) => {
      const desired =
        part === 'yaw'
          ? series.column('desired_yaw_rad').map(v => v * factor)
          : list('desired', part, factor);
      const wanted = desired.map((value, i) => (controlled[i] ? value : null));
      const estimate = list('est', part, factor);
      const all = [];
      if (band)
        all.push({
          name: 'allowed',
          x: time,
          y: wanted,
          low: wanted.map(v => (v === null ? null : v - band)),
          high: wanted.map(v => (v === null ? null : v + band)),
          color: colors.limit,
          mark: 'band',
        });
      all.push(
        line('truth', list('true', part, factor), colors.truth, {width: 3.5}),
        line('desired', wanted, colors.desired, {mark: 'dashes'}),
        line(
          'estimate',
          estimate.map((v, i) => (found[i] ? v : null)),
          colors.estimate,
        ),
      );
      if (found.includes(false))
        all.push({
          name: 'not detected',
          x: time,
          y: estimate.map((v, i) => (found[i] ? null : v)),
          color: colors.estimate,
          mark: 'dots',
          dot: 2.4,
        });
      const span = axisSpan(
        [
          all.find(s => s.name === 'truth').y,
          wanted,
          estimate.filter((v, i) => found[i]),
          band ? wanted.map(v => (v === null ? null : v + band)) : [],
          band ? wanted.map(v => (v === null ? null : v - band)) : [],
          rule === undefined ? [] : [rule],
        ],
        least,
      );
      panels.push({
        title,
        x,
        y: {low: span[0], high: span[1]},
        legend: 'none',
        blocks: ground,
        height: 118,
        series: all,
        rules:
          rule === undefined
            ? []
            : [{at: rule, name: String(Math.round(rule)), color: colors.limit, mark: 'line'}],
      });
    };
    pose('x, mm', 'x', 1000, 0, 100, limits.docked_x_m * 1000);
    pose('y, mm', 'y', 1000, limits.tolerance_y_m * 1000, 3000 * limits.tolerance_y_m);
    pose('z, mm', 'z', 1000, limits.tolerance_z_m * 1000, 3000 * limits.tolerance_z_m);
    pose('yaw, °', 'yaw', kDeg, 0, 10);
    const several = (title, names, factor = 1) =>
      panels.push({
        title,
        x,
        y: {},
        legend: 'none',
        blocks: ground,
        rules: [],
        height: 112,
        series: names
          .filter(([, column]) => series.column(column).length)
          .map(([name, column], i) =>
            line(
              name,
              series.column(column).map(v => (v === null ? null : v * factor)),
              curve(i),
            ),
          ),
      });
    several(
      'thrusters, V',
      Object.keys(series.columns)
        .filter(name => name.endsWith('_v'))
        .map(name => [words(name.slice(0, -2)), name]),
    );
    several(
      'speed, mm/s',
      [
        ['surge', 'surge_mps'],
        ['sway', 'sway_mps'],
        ['heave', 'heave_mps'],
      ],
      1000,
    );
    several('contact, N', [
      ['dock', 'dock_force_newton'],
      ['collision', 'collision_force_newton'],
    ]);
    panels[panels.length - 1].y = {low: 0, least_span: 1};
    panels[panels.length - 1].x = {...x, label: 'time, s'};
    const used = panels.filter(panel => panel.series.length);
    used[used.length - 1].height += 30;
    return [stageBar, ...used];
  }

  yaw(prefix) {
    const out = [];
    for (let i = 0; i < this.series.length; ++i) {
      const pose = this.series.pose(prefix, i);
      out.push(pose ? yawOf(pose) : null);
    }
    return out;
  }
}

// Light enough for dark letters in both themes.
const stageFill = rgb =>
  rgb ? `rgb(${rgb.map(c => Math.round(c + (255 - c) * 0.35)).join(' ')})` : '#999';

function axisSpan(lists, least) {
  let low = Infinity;
  let high = -Infinity;
  for (const list of lists)
    for (const v of list)
      if (Number.isFinite(v)) {
        low = Math.min(low, v);
        high = Math.max(high, v);
      }
  if (low > high) low = high = 0;
  const half = Math.max(0.55 * (high - low), least / 2);
  const middle = (low + high) / 2;
  return [middle - half, middle + half];
}
