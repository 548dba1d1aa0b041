// A trial while it runs: the view of a trial, fed by the program, with hands on it.

import {h, button, fill, section, soon} from 'page/dom.js';
import {Clock} from 'page/clock.js';
import {clockText, fixed} from 'page/format.js';
import {Knobs} from 'page/knobs.js';
import {badge, head, plainTable, stages} from 'page/parts.js';
import {Push} from 'page/push.js';
import {Line} from 'page/socket.js';
import {TrialView} from 'page/trial.js';

const kShownChanges = 40;
const kHeadEvery_ms = 200; // it is text for people
const kComplaint_ms = 6000;
const kCutOff = 'The program has ended, or cannot be reached. What is shown is the last of it.';

/** The program's time: play and pause are its, looking back is the page's own. */
class LiveClock extends Clock {
  constructor(send) {
    super();
    this.send = send;
    this.follow = true;
  }
  toggle() {
    // over again, from the page's own memory
    if (this.ended) return this.playing ? super.pause() : super.play();
    this.follow = true;
    this.send({do: this.playing ? 'pause' : 'go'});
  }
  pause() {} // looking back stops nothing
  setSpeed(factor) {
    super.setSpeed(factor);
    this.send({do: 'speed', factor});
  }
}

export const show = host => new LivePage(host);

class LivePage {
  constructor(host) {
    this.status = {};
    this.transitions = [];
    this.changes = [];
    this.shown = []; // times at which pictures were shown, of the last second
    this.heading = h('div', {class: 'column', 'aria-live': 'off'});
    this.alert = h('p', {class: 'missing', role: 'alert', hidden: true});
    const waiting = h('p', {class: 'note'}, 'Waiting for the first frame …');
    this.ground = h('div', {class: 'column'}, waiting);
    this.below = h('div', {class: 'column'});
    host.append(this.heading, this.alert, this.ground, this.below);
    const send = command => this.line.send(command);
    this.clock = new LiveClock(send);
    this.knobs = new Knobs(send);
    this.drawHead = soon(
      () => this.drawHeadNow(),
      draw => setTimeout(draw, kHeadEvery_ms),
    );
    addEventListener('keydown', event => {
      if (event.key === '.' && !event.target.closest?.('input, select, textarea')) this.step();
    });
    this.line = new Line({
      onMessage: (message, pictures) => this.take(message, pictures),
      onState: isOpen => this.connected(isOpen),
    });
  }

  connected(isOpen) {
    this.isOpen = isOpen;
    this.alert.hidden = isOpen;
    if (!isOpen) fill(this.alert, kCutOff);
    this.drawHead();
  }

  take({problem, trial, controls, transitions, changes, rows, status, pictures: of}, pictures) {
    if (problem) this.complain(problem);
    if (trial) this.begin(trial);
    if (controls) this.knobs.set(controls);
    this.transitions.push(...(transitions || []));
    this.changes.push(...(changes || []));
    if (trial || transitions || changes) this.drawBelow();
    if (rows) this.append(rows);
    if (pictures) this.showPictures(of.frame, pictures);
    if (status) this.setStatus(status);
  }

  complain(problem) {
    this.alert.hidden = false;
    fill(this.alert, problem);
    clearTimeout(this.timer);
    this.timer = setTimeout(() => {
      this.alert.hidden = this.isOpen;
    }, kComplaint_ms);
  }

  begin(trial) {
    this.trial = trial;
    this.transitions = [];
    this.changes = [];
    document.title = trial.title;
    if (!this.trialView) return;
    this.trialView.restart(trial);
    this.clock.follow = true;
    if (document.activeElement !== this.seed) this.seed.value = trial.seed;
  }

  append(rows) {
    if (this.trialView) return this.trialView.append(rows);
    fill(this.ground);
    const view = (this.trialView = new TrialView(
      this.ground,
      {...this.trial, series: rows},
      {clock: this.clock, controls: this.controls(), live: true},
    ));
    view.left.append(this.knobs.element);
    view.scene?.ready.then(() => {
      if (!view.scene.renderer) return;
      const push = new Push(view.scene, force_newton => this.line.send({do: 'push', force_newton}));
      view.scene.element.after(push.element);
    });
  }

  step() {
    this.clock.follow = true;
    this.line.send({do: 'step'});
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
    const restart = () => this.line.send({do: 'restart', seed: this.seed.value.trim()});
    const follow = () => {
      this.clock.follow = true;
      this.clock.seek(this.clock.end);
    };
    const next = () => {
      this.seed.value = String(BigInt(this.trial.seed) + 1n);
      restart();
    };
    this.now = button('Now', follow, {title: 'follow the trial again'});
    return [
      button('Step', () => this.step(), {title: 'let one frame pass (.)'}),
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

  showPictures(frame, pictures) {
    const view = this.trialView;
    if (!view) return;
    const before = view.cameras.pictures;
    const time = clockText(frame / this.trial.frames_per_second);
    view.cameras.show(pictures, view.estimateAt(frame), `Picture of ${time} with its estimate.`);
    for (const picture of Object.values(before)) picture.close();
    this.shown = [...this.shownLately(), performance.now()];
    const count = Number(document.documentElement.dataset.pictures || 0);
    document.documentElement.dataset.pictures = String(count + 1);
  }
  shownLately() {
    return this.shown.filter(time => time > performance.now() - 1000);
  }

  setStatus(status) {
    this.status = status;
    const {clock} = this;
    const {ended, speed} = status;
    const isPlaying = ended ? clock.playing && clock.ended : status.going;
    if (ended !== clock.ended || isPlaying !== clock.playing || speed !== clock.speed) {
      Object.assign(clock, {ended, speed, playing: isPlaying});
      this.trialView?.setSpeed(speed);
      clock.tell();
    }
    this.drawHead();
  }

  drawHeadNow() {
    const {status, trial, isOpen} = this;
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
      fact('pictures', `${this.shownLately().length} /s`, 'pairs shown here in the last second'),
      fact('changes', String(this.changes.length), 'settings changed and pushes while it ran'),
    ];
    if (status.digest) facts.push(fact('digest', status.digest, 'equal for equal trials'));
    const text = [state, status.reason, ...facts.map(({value}) => value)].join();
    if (text === this.headText) return;
    this.headText = text;
    fill(
      this.heading,
      head({
        badge: badge(state, status.ended ? undefined : isOpen ? 'none' : 'bad'),
        title: trial.description,
        reason: status.reason,
        note: `seed ${trial.seed}`,
        facts,
      }),
    );
  }

  drawBelow() {
    const last = this.changes.slice(-kShownChanges).reverse();
    const rows = last.map(({time_s, key, value}) => [
      `${fixed(time_s, 2)} s`,
      key,
      key === 'push' ? `${value} N` : value,
    ]);
    const columns = ['time', 'key', 'value'].map(label => ({label}));
    const note = last.length
      ? `${this.changes.length} in all, the last ones first; the trial’s record has every one of them.`
      : 'Nothing: its digest is that of a trial that nobody watched.';
    fill(
      this.below,
      stages(this.transitions, this.trial.frames_per_second, time => this.clock.lookAt(time)),
      section('Changed while it ran', {note}, last.length ? plainTable({columns, rows}) : null),
    );
    this.drawHead();
  }
}
