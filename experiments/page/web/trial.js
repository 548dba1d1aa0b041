// One trial: how it ended, what happened, in plots, pictures and 3D. The live page feeds the same view.

import {h, button, choice, section, soon} from 'page/dom.js';
import {addressOf, has, load} from 'page/data.js';
import {clockText, fixed, measured, number, shown, spoken, words} from 'page/format.js';
import {Cameras} from 'page/cameras.js';
import {Clock} from 'page/clock.js';
import {Scene3d} from 'page/scene3d.js';
import {Series, compose, inverse} from 'page/series.js';
import {Traces} from 'page/traces.js';
import {badge, command, facts, head, kFitness, plainTable, reveal, stages} from 'page/parts.js';

const kLiveEvery_ms = 150; // between two drawings of growing traces
const kBeforeEnd_s = 0.5; // where a trial that has ended is shown

/** What main.js calls for a trial's report. */
export function show(host, model) {
  const view = new TrialView(host, model, {video: has('video')});
  view.clock.seek(view.series.end - kBeforeEnd_s);
  return view;
}

/**
 * Opens trials in an element: {title, outcome, reason, facts, note, commands, model, series}; model and series are
 * names of the page's parts, or what those hold. Their traces are on one clock, which stands where the first of them
 * ends.
 */
export async function openTrials(element, {title, note, trials}) {
  const clock = new Clock();
  const box = h('div', {class: 'column'});
  element.replaceChildren(box);
  if (title) box.append(section(title, {note}));
  const ends = [];
  for (const trial of trials) {
    box.append(
      section(
        trial.title,
        {},
        h(
          'div',
          {class: 'line'},
          badge(trial.outcome),
          h('span', {class: 'reason'}, spoken(trial.reason)),
        ),
        facts(trial.facts),
        trial.commands.map(command),
        trial.note ? h('p', {class: 'note'}, trial.note) : null,
      ),
    );
    const model = await held(trial.model);
    const series = (await held(trial.series)) || model?.series;
    if (!model || !series) continue;
    const view = new TrialView(box, {...model, series, record: null}, {clock});
    ends.push(view.series.end);
  }
  if (ends.length) {
    clock.setEnd(Math.max(...ends));
    clock.seek(Math.min(...ends) - kBeforeEnd_s);
  }
  reveal(box);
}

/** A part of the page by its name; itself where it is one already. */
const held = part => (typeof part === 'string' ? load(part) : part);

export class TrialView {
  /**
   * model: of a trial; its record, if it has one, is shown, too. options: {video: the page brings a film along, which
   * takes the pictures' place once it is played, clock, controls: elements for the bar, live: rows and pictures come as
   * the trial goes on}.
   */
  constructor(host, model, {video = false, clock = new Clock(), controls = [], live = false} = {}) {
    const series = new Series(model.series);
    Object.assign(this, {model, series, clock, live});
    if (model.record) host.append(...head(heading(model)));
    this.transport(host, controls);
    this.left = h('div', {class: 'column view'});
    const {docking_fitness: I, detection_fitness: II} = model.limits;
    const areas = `Area I, from ${fixed(I, 2)}: it may dock; Area II, from ${fixed(II, 2)}: detected; Area III: not.`;
    const plots = section('What happened', {note: `${kFitness}. ${areas}`});
    const rest = (this.rest = h('div', {class: 'column rest'}));
    host.append(h('div', {class: 'trial-grid'}, this.left, plots, rest));
    if (model.scene) this.addScene();
    this.cameraBox = section('Cameras', {
      note: video ? 'The film is loaded when it is played.' : null,
    });
    this.left.append(this.cameraBox);
    this.cameras = new Cameras(this.cameraBox, model);
    this.hasFilm = video;
    this.traces = new Traces(plots, model, series, clock);
    this.updateSoon = soon(
      () => this.update(),
      live ? draw => setTimeout(draw, kLiveEvery_ms) : requestAnimationFrame,
    );
    clock.setEnd(series.end);
    clock.on(() => this.show());
    this.show();
    if (model.record) this.drawRest(host, rest);
  }

  /** Rows that came after; the same columns. */
  append(columns) {
    this.series.append(columns);
    this.clock.setEnd(this.series.end);
    this.updateSoon();
  }
  update() {
    if (!this.series.length) return;
    this.traces.update();
    this.scene?.setSeries(this.series);
    this.show();
  }

  /** Another trial of the same scenario begins: its rows will follow. */
  restart(model) {
    this.model = model;
    this.series.clear();
    this.clock.setEnd(0);
    this.clock.seek(0);
  }

  drawRest(host, rest) {
    const {model, clock} = this;
    const seek = time => {
      clock.pause();
      clock.seek(time);
    };
    const {transitions} = model.record;
    if (transitions.length) rest.append(stages(transitions, model.frames_per_second, seek));
    rest.append(
      section(
        'Settings that differ',
        {note: 'From what every scenario begins with.'},
        model.settings?.length
          ? plainTable({
              columns: [{label: 'key'}, {label: 'here'}, {label: 'default'}],
              rows: model.settings.map(({key, value, default: usual}) => [
                key,
                value,
                usual || '–',
              ]),
            })
          : h('p', {}, 'None.'),
      ),
      section('Again', {}, model.commands.map(command)),
    );
    host.append(section('All figures', {}, facts(flat(withoutNoise(model), model.names))));
  }

  transport(host, controls) {
    const {clock} = this;
    this.play = button('', () => clock.toggle(), {class: 'play', title: 'play or pause (space)'});
    this.slider = h('input', {
      type: 'range',
      min: 0,
      step: 'any',
      'aria-label': 'time in the trial',
      oninput: () => {
        const time = Number(this.slider.value); // pausing shows the old time again
        clock.pause();
        clock.lookAt(time);
      },
    });
    this.now = h('output', {class: 'now'});
    const speeds = [0.25, 0.5, 1, 2, 4, 8].map(s => [String(s), `${s}×`]);
    const speed = choice('speed', speeds, '1', value => clock.setSpeed(Number(value)));
    this.speed = speed.querySelector('select');
    const parts = [this.play, this.slider, this.now, speed, controls];
    const bar = h('div', {class: 'line transport', role: 'group', 'aria-label': 'time'}, parts);
    host.append(bar);
    addEventListener('keydown', event => {
      const isTaken =
        event.defaultPrevented ||
        event.target.closest?.('button, input, select, textarea, video, [role=table]');
      if (event.key !== ' ' || isTaken || !bar.isConnected) return;
      event.preventDefault();
      clock.toggle();
    });
  }

  /** Shows a speed that was set elsewhere. */
  setSpeed(factor) {
    if (document.activeElement !== this.speed) this.speed.value = String(factor);
  }

  addScene() {
    const box = section(this.live ? '3D' : '3D replay');
    this.left.append(box);
    this.scene = new Scene3d(box, this.model);
    this.scene.ready.then(() => {
      this.scene.setSeries(this.series);
      this.show();
    });
  }

  addFilm() {
    this.hasFilm = false;
    const label = 'film: left and right camera with the estimated marker';
    const more = {playsinline: true, preload: 'auto', tabindex: -1, 'aria-label': label};
    this.video = h('video', {src: addressOf('video', 'video/mp4'), ...more});
    this.video.muted = true;
    this.video.addEventListener('loadedmetadata', () => this.showFilm());
    this.cameraBox.replaceChildren(
      h('h2', {}, 'Cameras, filmed'),
      h('div', {class: 'film'}, this.video),
    );
  }
  showFilm() {
    const {video, clock} = this;
    if (!video.duration) return;
    const time = Math.min(clock.time, video.duration - 0.01);
    const isPlaying = clock.playing && time < video.duration - 0.05;
    const late_s = Math.abs(video.currentTime - time);
    const most_s = isPlaying && !video.paused ? 0.25 * Math.max(1, clock.speed) : 0.01;
    video.playbackRate = Math.min(8, Math.max(0.1, clock.speed));
    if (late_s > most_s) video.currentTime = time;
    if (!isPlaying) video.pause();
    else if (video.paused) video.play().catch(() => {});
  }

  /** The marker's pose in the camera head by a row, and whether that counts as found. */
  estimateAt(row) {
    const F = this.series.at('fitness', row);
    return {
      pose: this.series.pose('est', row),
      isFound: F >= this.model.limits.detection_fitness,
    };
  }

  /** The estimate at the row's time: as far from the truth as it was from that of its image. */
  estimateNow(row, estimate) {
    const [truth, atImage] = ['true', 'true_at_image'].map(which => this.series.pose(which, row));
    return truth && atImage ? compose(truth, compose(inverse(atImage), estimate)) : estimate;
  }

  /** Everything at the clock's time. */
  show() {
    const {clock, series} = this;
    const row = series.indexAt(clock.time);
    const play = clock.playing ? '❚❚ Pause' : '▶ Play';
    if (this.play.textContent !== play) this.play.textContent = play;
    this.slider.max = String(Math.max(clock.end, 0.001));
    this.slider.value = String(clock.time);
    const stage = words(series.at('stage', row) || '');
    this.slider.setAttribute('aria-valuetext', `${clockText(clock.time)}, ${stage}`);
    const hasEnded = clock.time > series.end + 0.1; // another trial of the same clock goes on
    const state = hasEnded ? 'ended' : `F ${fixed(series.at('fitness', row), 2)}`;
    const time = clockText(hasEnded ? series.end : clock.time);
    this.now.textContent = row < 0 ? '–' : `${time} · ${stage} · ${state}`;
    if (row < 0) return;
    const estimate = this.estimateAt(row);
    this.scene?.update(
      series.pose('vehicle', row),
      series.pose('true', row),
      estimate.isFound ? this.estimateNow(row, estimate.pose) : null,
      row,
    );
    if (this.hasFilm && clock.playing) this.addFilm();
    if (this.video) this.showFilm();
    else if (!this.live) this.showFrame(estimate);
  }

  /** The picture nearest to the time, with its own estimate. */
  showFrame(estimate) {
    const {series, clock, cameras} = this;
    const {frames} = this.model;
    if (!frames?.length)
      return cameras.show({}, estimate, 'No pictures were kept; the circles are the estimate.');
    const late_s = frame => Math.abs(frame.time_s - clock.time);
    const frame = frames.reduce((best, other) => (late_s(other) < late_s(best) ? other : best));
    if (frame === this.frame) return;
    this.frame = frame;
    const image = base64 => Object.assign(new Image(), {src: `data:image/jpeg;base64,${base64}`});
    const pictures = {left: image(frame.left), right: image(frame.right)};
    const own = this.estimateAt(series.indexAt(frame.time_s));
    const caption = `Picture of ${clockText(frame.time_s)} ${circlesOf(own)}; ${frames.length} pictures kept.`;
    Promise.all(Object.values(pictures).map(picture => picture.decode())).then(
      () => this.frame === frame && cameras.show(pictures, own, caption),
    );
  }
}

/** What the circles in a picture are. */
export const circlesOf = ({isFound}) =>
  isFound ? 'with its estimate' : 'in which nothing was detected: the faint circles are a guess';

/** The record without what is noise: the estimate where nothing is detected, and what never began, are null. */
function withoutNoise({record, series, limits}) {
  const rows = new Series(series);
  const F = rows.at('fitness', rows.indexAt(record.time_s)) ?? record.fitness_best;
  const hasServoed = record.transitions.some(({to}) => to === 'visual_servoing');
  return {
    ...record,
    ...(F >= limits.detection_fitness ? {} : {final_error_estimated: null}),
    ...(hasServoed ? {} : {tracking_rms_m: null, overshoot_m: null}),
    ...(record.insertion_depth_m > 0 ? {} : {insertion_depth_m: null}),
  };
}

/** What is looked for first in a trial's record. */
function heading(model) {
  const {description, seed, sight_m, missing} = model;
  const record = withoutNoise(model);
  const e = record.final_error_true || {};
  const error_mm = ['x', 'y', 'z']
    .map(axis => `${axis} ${fixed(1000 * e[`${axis}_m`], 0)}`)
    .join(', ');
  const depth_m = record.insertion_depth_m;
  const fact = (label, value, note) => ({label, value, note});
  return {
    badge: badge(record.outcome),
    title: description,
    reason: spoken(record.reason),
    note: [`seed ${seed}`, sight_m && `one could see ${number(sight_m, 2)} m`]
      .filter(Boolean)
      .join(', '),
    missing,
    facts: [
      fact('time', clockText(record.time_s)),
      fact('true error', `${error_mm} mm`, 'of x, y and z at that time'),
      fact('yaw', `${fixed((e.yaw_rad * 180) / Math.PI, 1)}°`, 'true error at that time'),
      fact('F, mean', fixed(record.fitness_mean, 2), `over all frames. ${kFitness}`),
      fact(
        'pole in',
        depth_m === null ? '–' : `${fixed(depth_m * 1000, 0)} mm`,
        'depth of the pole’s tip past the dock’s mouth, at the end',
      ),
      fact(
        'false confidence',
        `${fixed(record.false_confidence_s, 1)} s`,
        'in which the estimate claimed to be nearer than it was',
      ),
      fact('returns', String(record.returns_to_servoing), 'from docking to visual servoing'),
    ],
  };
}

/** A record's values with their keys dotted: [{label, value, note: key}]. */
function flat(record, names, path = '') {
  return Object.entries(record).flatMap(([key, value]) => {
    const name = path ? `${path}.${key}` : key;
    if (['transitions', 'reason', 'log'].includes(key)) return [];
    if (value && typeof value === 'object' && !Array.isArray(value))
      return flat(value, names, name);
    const {label, unit, factor} = names[name];
    const text =
      typeof value === 'number'
        ? measured(number(value * factor), unit)
        : Array.isArray(value)
          ? value.map(shown).join(', ') || 'none'
          : shown(value);
    return {label, value: text, note: name};
  });
}
