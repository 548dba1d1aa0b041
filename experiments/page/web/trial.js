// One trial: the sections of its report on one clock. The live page feeds the same view.

import {h, button, choice, section, soon} from 'page/dom.js';
import {addressOf, has, load} from 'page/data.js';
import {clockText, fixed, spoken, words} from 'page/format.js';
import {Cameras} from 'page/cameras.js';
import {Clock} from 'page/clock.js';
import {badge, command, facts, reveal} from 'page/parts.js';
import {Sync} from 'page/plot.js';
import {drawHead, drawSection} from 'page/report.js';
import {Scene3d} from 'page/scene3d.js';
import {Series, compose, inverse} from 'page/series.js';

const kLiveEvery_ms = 150; // between two drawings of growing traces
const kBeforeEnd_s = 0.5; // where a trial that has ended is shown

/** What main.js calls for a trial's report. */
export function show(host, model) {
  drawHead(host, model);
  const view = new TrialView(host, model, {video: has('video')});
  view.clock.seek(view.series.end - kBeforeEnd_s);
  return view;
}

/**
 * Opens trials in an element: {title, outcome, reason, facts, note, commands, model, series}; model and series (traces:
 * {series, sections}) are names of the page's parts, or what those hold. Their traces are on one clock, which stands
 * where the first of them ends.
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
    const {series, sections} = (await held(trial.series)) || model || {};
    if (!series) continue;
    const traces = sections.filter(({player, stacked}) => player || stacked);
    const view = new TrialView(box, {...model, series, sections: traces}, {clock});
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
   * model: of a trial, with series and the sections to show. options: {video: the page brings a film along, which takes
   * the pictures' place once it is played, clock, controls: elements for the bar, live: rows and pictures come as the
   * trial goes on}.
   */
  constructor(host, model, {video = false, clock = new Clock(), controls = [], live = false} = {}) {
    Object.assign(this, {model, clock, live, hasFilm: video, plots: []});
    this.players = {replay: box => this.addScene(box), cameras: box => this.addCameras(box)};
    this.series = new Series(model.series);
    this.sync = new Sync(time => this.seek(time));
    this.transport(host, controls);
    this.left = h('div', {class: 'column view'});
    this.middle = h('div', {class: 'column middle'});
    this.rest = h('div', {class: 'column rest'});
    host.append(h('div', {class: 'trial-grid'}, this.left, this.middle, this.rest));
    for (const part of model.sections) this.place(part, host);
    this.updateSoon = soon(
      () => this.update(),
      live ? draw => setTimeout(draw, kLiveEvery_ms) : requestAnimationFrame,
    );
    clock.setEnd(this.series.end);
    clock.on(() => {
      // where the clock follows growing rows, the cursor moves with them: see update
      if (!(clock.follow && clock.playing)) this.sync.setCursor(clock.time);
      this.show();
    });
    this.show();
  }

  /** Draws a section where its kind has its place. */
  place(part, host) {
    const {left, middle, rest} = this;
    const column = part.player ? left : part.stacked ? middle : part.wide ? host : rest;
    const box = drawSection(part, this);
    if (box) column.append(box);
  }

  /** Links of sections are times, "t=12.3". */
  isLink(link) {
    return /^t=/.test(link);
  }
  open(link) {
    this.seek(Number(link.slice(2)));
  }
  seek(time) {
    this.clock.pause();
    this.clock.lookAt(time);
  }

  /** Rows that came after: {series, sections}, the same columns and curves. */
  append({series, sections}) {
    this.series.append(series);
    const {panels} = sections.find(({stacked}) => stacked);
    this.isNew ? this.stack.set(panels) : this.stack.grow(panels);
    this.isNew = false;
    this.clock.setEnd(this.series.end);
    this.updateSoon();
  }
  update() {
    if (!this.series.length) return;
    if (this.clock.follow) this.sync.setCursor(this.clock.time);
    this.scene?.setSeries(this.series);
    this.show();
  }

  /** Another trial of the same scenario begins: its rows will follow. */
  restart(model) {
    this.model = model;
    this.isNew = true;
    this.series.clear();
    this.clock.setEnd(0);
    this.clock.seek(0);
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

  addScene(box) {
    if (!this.model.scene) return false;
    this.scene = new Scene3d(box, this.model);
    this.scene.ready.then(() => {
      this.scene.setSeries(this.series);
      this.show();
    });
  }

  addCameras(box) {
    if (this.hasFilm) box.append(h('p', {class: 'note'}, 'The film is loaded when it is played.'));
    this.cameraBox = box;
    this.cameras = new Cameras(box, this.model);
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
      return cameras.show(
        {},
        estimate,
        `No pictures were kept${estimate.isFound ? '; the circles are the estimate' : ''}.`,
      );
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
  isFound ? 'with its estimate' : 'in which F is too low: the faint circles are a guess';
