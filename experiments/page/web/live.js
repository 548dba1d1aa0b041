// A trial while it runs: the view of a trial, fed by the program, with hands on it.

import {h, button, fill, section, soon} from 'page/dom.js';
import {clockText, fixed, words} from 'page/format.js';
import {Knobs} from 'page/knobs.js';
import {Film, LiveClock} from 'page/live_clock.js';
import {badge, head, plainTable} from 'page/parts.js';
import {Program} from 'page/program.js';
import {Push} from 'page/push.js';
import {circlesOf, TrialView} from 'page/trial.js';

const kShownChanges = 40;
const kHeadEvery_ms = 200; // it is text for people
const kComplaint_ms = 6000;
const kEnded = 'The trial has ended; Restart or Next seed begins another to step or push.';
const kCutOff = 'The program has ended, or cannot be reached. What is shown is the last of it.';

export const show = host => new LivePage(host);

class LivePage {
  constructor(host) {
    this.heading = h('div', {class: 'column', 'aria-live': 'off'});
    this.alert = h('p', {class: 'missing', role: 'alert', hidden: true});
    const waiting = h('p', {class: 'note'}, 'Waiting for the program …');
    this.ground = h('div', {class: 'column'}, waiting);
    this.below = h('div', {class: 'column'});
    host.append(this.heading, this.alert, this.ground);
    this.program = new Program((news, picture) => this.take(news, picture));
    const send = command => this.program.send(command);
    this.clock = new LiveClock(send);
    this.clock.on(() => this.lookBack());
    this.knobs = new Knobs(send);
    this.push = new Push(
      () => this.trialView.series.pose('vehicle', this.trialView.series.length - 1),
      force_newton => send({do: 'push', force_newton}),
    );
    this.knobs.body.before(this.push.element);
    this.drawHead = soon(
      () => this.drawHeadNow(),
      draw => setTimeout(draw, kHeadEvery_ms),
    );
    addEventListener('keydown', event => {
      if (event.key === '.' && !event.target.closest?.('input, select, textarea')) this.step();
    });
  }

  get trial() {
    return this.program.trial;
  }
  get status() {
    return this.program.status;
  }

  async take(news, picture) {
    const {isOpen, problem, trial, controls, transitions, changes, rows, sight_m, status} = news;
    if (isOpen !== undefined) this.connected(isOpen);
    if (problem) this.complain(problem);
    if (trial) this.begin(trial);
    if (controls) this.knobs.set(controls);
    if (trial || transitions || changes) this.drawBelow();
    if (rows) this.append(rows);
    if (sight_m !== undefined) this.trialView.scene?.setSight(sight_m);
    if (status) this.showStatus(status);
    if (picture) await this.keep(picture);
  }

  connected(isOpen) {
    this.alert.hidden = isOpen;
    if (!isOpen) fill(this.alert, kCutOff);
    this.drawHead();
  }

  complain(problem) {
    this.alert.hidden = false;
    fill(this.alert, problem);
    clearTimeout(this.timer);
    this.timer = setTimeout(() => {
      this.alert.hidden = this.program.isOpen;
    }, kComplaint_ms);
  }

  begin(trial) {
    this.film = new Film();
    this.last = this.shown = null;
    document.title = trial.title;
    if (!this.trialView) return;
    this.clock.catchUp();
    this.trialView.restart(trial);
    this.trialView.cameras.show({}, {}, 'No picture yet.');
    if (document.activeElement !== this.seed) this.seed.value = trial.seed;
  }

  /** Columns come with every trial, even if it has no row yet. */
  append(rows) {
    if (this.trialView) return this.trialView.append(rows);
    fill(this.ground);
    const view = (this.trialView = new TrialView(
      this.ground,
      {...this.trial, ...rows},
      {clock: this.clock, controls: this.controls(), live: true},
    ));
    view.left.after(this.knobs.element);
    view.rest.append(this.below);
    this.allowHands();
  }

  /** Hands off what has ended. */
  allowHands() {
    const {ended} = this.status;
    this.push.stop(ended ? kEnded : '');
    this.stepButton.disabled = Boolean(ended);
    this.stepButton.title = ended ? kEnded : 'let one frame pass (.)';
  }

  step() {
    if (this.status.ended) return this.complain(kEnded);
    this.clock.follow = true;
    this.program.send({do: 'step'});
  }

  /** Of the bar: single steps, the end, another trial. */
  controls() {
    this.seed = h('input', {
      type: 'text',
      inputmode: 'numeric',
      size: 6,
      value: this.trial.seed,
      'aria-label': 'seed',
    });
    const restart = () => this.program.send({do: 'restart', seed: this.seed.value.trim()});
    const next = () => {
      this.seed.value = String(BigInt(this.trial.seed) + 1n);
      restart();
    };
    this.stepButton = button('Step', () => this.step());
    this.now = button('Now', () => this.clock.catchUp(), {title: 'follow the trial again'});
    return [
      this.stepButton,
      this.now,
      h(
        'span',
        {class: 'line restart'},
        h('label', {class: 'choice'}, h('span', {}, 'seed'), this.seed),
        button('Restart', restart, {
          title: 'begin again with this seed and the settings as they are',
        }),
        button('Next seed', next, {title: 'begin again with the next seed'}),
      ),
    ];
  }

  async keep(picture) {
    this.film.add(picture);
    this.last = picture;
    if (this.clock.follow) await this.show(picture);
    const count = Number(document.documentElement.dataset.pictures || 0);
    document.documentElement.dataset.pictures = String(count + 1);
  }

  /** The picture of the clock's time. */
  lookBack() {
    if (!this.last) return;
    const frame = Math.round(this.clock.time * this.trial.frames_per_second);
    this.show(this.clock.follow ? this.last : this.film.nearest(frame, this.last));
  }
  async show(picture) {
    if (picture === this.shown) return;
    this.shown = picture;
    const files = [picture.left, picture.right];
    const [left, right] = await Promise.all(files.map(file => createImageBitmap(file)));
    if (picture !== this.shown) return;
    const {cameras} = this.trialView;
    const before = cameras.pictures;
    const time = clockText(picture.frame / this.trial.frames_per_second);
    const estimate = this.trialView.estimateAt(picture.frame);
    cameras.show({left, right}, estimate, `Picture of ${time} ${circlesOf(estimate)}.`);
    for (const bitmap of Object.values(before)) bitmap.close();
  }

  showStatus(status) {
    if (this.clock.set(status)) {
      this.trialView.setSpeed(status.speed);
      this.allowHands();
    }
    this.drawHead();
  }

  drawHeadNow() {
    const {status, trial, isOpen, changes} = this.program;
    if (!trial) return;
    const running = status.going ? 'running' : 'paused';
    const state = !isOpen ? 'gone' : status.ended ? status.outcome : running;
    this.now?.setAttribute('aria-pressed', String(this.clock.follow));
    const fact = (label, value, note) => ({label, value, note});
    const seconds = (status.frames || 0) / trial.frames_per_second;
    const passed = 'simulated over passed time, of the last second that it ran';
    const facts = [
      fact('simulated', clockText(seconds)),
      fact('of real time', `${fixed(status.real_time_factor, 2)} ×`, passed),
      fact('changes', String(changes.length), 'settings changed and pushes while it ran'),
    ];
    if (status.digest) facts.push(fact('digest', status.digest, 'equal for equal trials'));
    const text = [state, status.reason, ...facts.map(({value}) => value)].join();
    if (text === this.headText) return;
    this.headText = text;
    fill(
      this.heading,
      head({
        badge: badge(state, status.ended ? undefined : isOpen ? 'none' : 'bad'),
        title: trial.title,
        reason: status.reason,
        facts,
      }),
    );
  }

  drawBelow() {
    const {transitions, changes, trial} = this.program;
    const last = changes.slice(-kShownChanges).reverse();
    const rows = last.map(({time_s, key, value}) => [
      `${fixed(time_s, 2)} s`,
      key,
      key === 'push' ? `${value} N` : value,
    ]);
    const stages = transitions.map(({frame, from, to, reason}) => {
      const time = frame / trial.frames_per_second;
      const text = clockText(time);
      const onclick = () => this.clock.lookAt(time);
      return [{text, title: `go to ${text}`, onclick}, words(from), words(to), reason];
    });
    const table = (labels, of) => plainTable({columns: labels.map(label => ({label})), rows: of});
    const note = last.length
      ? `${changes.length} in all, the last ones first; the trial’s record has every one of them.`
      : 'Nothing: its digest is that of a trial that nobody watched.';
    fill(
      this.below,
      section(
        'Stages',
        {note: stages.length ? null : 'None yet.'},
        stages.length ? table(['time', 'from', 'to', 'why'], stages) : null,
      ),
      section(
        'Changed while it ran',
        {note},
        last.length ? table(['time', 'key', 'value'], rows) : null,
      ),
    );
    this.drawHead();
  }
}
