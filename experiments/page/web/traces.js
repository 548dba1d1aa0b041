// The synchronised plots of one trial: F, x, y, z, yaw, voltages, speeds, forces.

import {h} from 'page/dom.js';
import {words} from 'page/format.js';
import {Plot, Sync} from 'page/plot.js';
import {yawOf} from 'page/series.js';
import {curve} from 'page/theme.js';

const kDeg = 180 / Math.PI;
const kNoStage = [128, 128, 128];
const kSearch_s = 1; // a search that begins anywhere: where it is until then sets no scale
const kHeight = {bar: 24, plot: 112, axis: 30}; // in pixels

/** Stages as spans of time: [{name, from, to, index}]. */
function stageSpans(series, stages) {
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

/** Multiplied, with its gaps. */
const times = (values, factor) => values.map(v => (Number.isFinite(v) ? v * factor : null));

/** [low, high] about all finite values, no closer together than `least`. */
function spanOf(lists, least) {
  const all = lists.flat().filter(Number.isFinite);
  const low = all.reduce((a, b) => Math.min(a, b), Infinity);
  const high = all.reduce((a, b) => Math.max(a, b), -Infinity);
  if (low > high) return {low: -least / 2, high: least / 2};
  const half = Math.max(0.55 * (high - low), least / 2);
  return {low: (low + high) / 2 - half, high: (low + high) / 2 + half};
}

export class Traces {
  /** trial: the model; series: a Series; clock: a Clock that the cursor moves and follows. */
  constructor(host, trial, series, clock) {
    Object.assign(this, {trial, series, clock});
    this.sync = new Sync(time => {
      clock.pause();
      clock.lookAt(time);
    });
    // where the clock follows growing rows, the cursor moves with them: see update
    clock.on(() => {
      if (!(clock.follow && clock.playing)) this.sync.setCursor(clock.time);
    });
    const grid = h('div', {class: 'traces'});
    this.plots = this.panels().map(
      panel =>
        new Plot(grid, panel, {
          sync: this.sync,
          height: panel.height,
          label: `${panel.title || 'stages'} over time; arrow keys move the time`,
        }),
    );
    const hint = 'Point to see values, drag to zoom, double click (or 0) for all.';
    host.append(grid, h('p', {class: 'note hint'}, hint));
  }

  /** After the series grew. */
  update() {
    if (this.clock.follow) this.sync.cursor = this.clock.time;
    this.panels().forEach((panel, i) => this.plots[i].set(panel));
  }

  /** One above the other; those whose columns the series lacks are left out. */
  panels() {
    const {limits} = this.trial;
    const {columns} = this.series;
    const spans = stageSpans(this.series, this.trial.stages);
    this.blocks = spans.map(({name, from, to, index}) => ({
      name: words(name),
      from_x: from,
      to_x: to,
      color: this.trial.colors.stages[index] || kNoStage,
    }));
    this.time = this.series.column('time_s');
    this.imageTime = this.series.column('image_time_s'); // of the estimate
    this.isFound = this.series.column('fitness').map(F => F >= limits.detection_fitness);
    const voltages = Object.keys(columns).filter(name => name.endsWith('_v'));
    const panels = [
      this.fitness(),
      this.pose('x, mm', 'x', 1000, {least: 100, rule: 1000 * limits.docked_x_m}),
      this.pose('y, mm', 'y', 1000, this.within(limits.enter_y_m, limits.tolerance_y_m)),
      this.pose('z, mm', 'z', 1000, this.within(limits.enter_z_m, limits.tolerance_z_m)),
      this.pose('yaw, °', 'yaw', kDeg, {least: 10}),
      this.several('thrusters, V', voltages, name => words(name.slice(0, -2))),
      this.several('speed, mm/s', ['surge_mps', 'sway_mps', 'heave_mps'], shortName, 1000),
      this.contact(),
    ].filter(panel => panel.series.length);
    const last = panels[panels.length - 1];
    last.x = {...last.x, label: 'time, s'};
    last.height += kHeight.axis;
    return [this.stageBar(), ...panels];
  }

  panel(title, series, more = {}) {
    const end = Math.max(this.series.end, 1);
    return {
      title,
      x: {low: 0, high: end},
      y: {},
      height: kHeight.plot,
      blocks: this.blocks.map(block => ({...block, name: '', opacity: 0.1})),
      rules: [],
      series,
      ...more,
    };
  }
  line(name, y, color, more = {}) {
    return {name, x: this.time, y, color, mark: 'line', width: 1.5, ...more};
  }
  rule(at, name) {
    return {at, name, color: this.trial.colors.limit, mark: 'line'};
  }

  stageBar() {
    // light enough for dark letters
    const lighter = color => color.map(c => Math.round(c + (255 - c) * 0.35));
    return this.panel('', [], {
      has_axes: false,
      y: {low: 0, high: 1},
      height: kHeight.bar,
      blocks: this.blocks.map(block => ({...block, color: lighter(block.color)})),
    });
  }

  fitness() {
    const {limits, colors} = this.trial;
    const F = this.series.column('fitness');
    return this.panel('F', [this.line('F', F, colors.estimate)], {
      y: {low: F.reduce((a, b) => Math.min(a, b), -0.25), high: 1.02},
      rules: [limits.docking_fitness, limits.detection_fitness].map(at =>
        this.rule(at, at.toFixed(2)),
      ),
    });
  }

  /** What is allowed about the desired value, by row: servoing must be closer than docking may be. */
  within(enter_m, tolerance_m) {
    const allowed = {
      visual_servoing: 1000 * enter_m,
      docking: 1000 * tolerance_m,
      docked: 1000 * tolerance_m,
    };
    const band = this.series.column('stage').map(stage => allowed[stage] ?? NaN);
    return {band, least: 3000 * tolerance_m};
  }

  /** band: allowed about the desired value, by row; least: span of the axis; rule: a limit. */
  pose(title, part, factor, {band, least, rule}) {
    const {series, isFound, time, imageTime} = this;
    const {colors} = this.trial;
    const controlled = series.column('controlled');
    const desired = series.column(part === 'yaw' ? 'desired_yaw_rad' : `desired_${part}_m`);
    const wanted = times(desired, factor).map((v, i) => (controlled[i] ? v : null));
    const truth = times(this.measured('true', part), factor);
    const all = times(this.measured('est', part), factor);
    const estimate = all.map((v, i) => (isFound[i] ? v : null));
    const bound = sign => wanted.map((v, i) => (v === null ? null : v + sign * band[i]));
    const bounds = band && {low: bound(-1), high: bound(1)};
    const allowed = {name: 'allowed', x: time, y: wanted, ...bounds, color: colors.limit};
    const lost = {
      name: 'not detected',
      x: imageTime,
      color: colors.estimate,
      mark: 'dots',
      dot: 2,
      opacity: 0.3,
    };
    const converged = estimate.filter((_, i) => time[i] >= kSearch_s);
    return this.panel(
      title,
      [
        // below the truth: nothing acts on them
        isFound.includes(false) ? {...lost, y: all.map((v, i) => (isFound[i] ? null : v))} : null,
        band ? {...allowed, mark: 'band'} : null,
        this.line('truth', truth, colors.truth, {width: 3.5}),
        this.line('desired', wanted, colors.desired, {mark: 'dashes'}),
        this.line('estimate', estimate, colors.estimate, {x: imageTime}),
      ].filter(Boolean),
      {
        y: spanOf([truth, converged, bounds?.low ?? [], bounds?.high ?? [], [rule]], least),
        rules: rule === undefined ? [] : [this.rule(rule, String(Math.round(rule)))],
      },
    );
  }
  measured(which, part) {
    if (part !== 'yaw') return this.series.column(`${which}_${part}_m`);
    return this.time.map((_, i) => {
      const pose = this.series.pose(which, i);
      return pose ? yawOf(pose) : null;
    });
  }

  /** A line for each of these columns. */
  several(title, names, called, factor = 1) {
    const there = names.filter(name => name in this.series.columns); // without a row yet, too
    const lines = there.map((name, i) =>
      this.line(called(name), times(this.series.column(name), factor), curve(i)),
    );
    return this.panel(title, lines);
  }

  contact() {
    const names = ['dock_force_newton', 'collision_force_newton'];
    const panel = this.several('contact, N', names, shortName);
    const most = panel.series.flatMap(({y}) => y).reduce((a, b) => Math.max(a, b), 0);
    return {...panel, y: {low: 0, high: Math.max(1, 1.07 * most)}};
  }
}

const shortName = column => column.split('_')[0];
