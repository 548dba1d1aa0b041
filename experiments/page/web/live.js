// A trial while it runs: the view of a trial, fed by the program, with hands on it.

import {h, button, fill, section} from 'page/dom.js';
import {Clock} from 'page/clock.js';
import {clockText, fixed, words} from 'page/format.js';
import {Knobs} from 'page/knobs.js';
import {badge, facts} from 'page/parts.js';
import {Push} from 'page/push.js';
import {Series} from 'page/series.js';
import {Line} from 'page/socket.js';
import {TrialView} from 'page/trial.js';

const kShownChanges = 40;

/** The program's time: play and pause are its, looking back is the page's own. */
class LiveClock extends Clock {
  constructor(send) {
    super();
    this.send = send;
    this.follow = true;
  }
  toggle() {
    // Over again, from the page's own memory.
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
    this.host = host;
    this.status = {};
    this.transitions = [];
    this.changes = [];
    this.shown = []; // times at which pictures were shown, of the last second
    this.head = h('header', {class: 'head', 'aria-live': 'off'});
    this.alert = h('p', {class: 'missing', role: 'alert', hidden: true});
    this.view = h(
      'div',
      {class: 'live-view'},
      h('p', {class: 'note'}, 'Waiting for the first frame …'),
    );
    this.below = h('div', {class: 'cards'});
    host.append(this.head, this.alert, this.view, this.below);
    this.clock = new LiveClock(command => this.line.send(command));
    this.knobs = new Knobs(command => this.line.send(command));
    this.stages = section('Stages', {}, h('p', {class: 'note'}, 'None yet.'));
    this.record = section(
      'Changed while it ran',
      {},
      h('p', {class: 'note'}, 'Nothing: its digest is that of a trial that nobody watched.'),
    );
    this.below.append(h('div', {class: 'column'}, this.stages, this.record));
    this.line = new Line({
      onMessage: (head, pictures) => this.take(head, pictures),
      onState: open => this.connected(open),
    });
  }

  connected(open) {
    this.open = open;
    this.alert.hidden = open;
    if (!open)
      this.alert.textContent =
        'The program has ended, or cannot be reached. What is shown is the last of it.';
    this.drawHead();
  }

  take(head, pictures) {
    if (head.problem) this.complain(head.problem);
    if (head.trial) this.begin(head.trial);
    if (head.controls) this.knobs.set(head.controls);
    if (head.transitions) this.addTransitions(head.transitions);
    if (head.changes) this.addChanges(head.changes);
    if (head.result) this.result = head.result;
    if (head.rows) this.append(head.rows);
    if (pictures) this.showPictures(head.pictures.frame, pictures);
    if (head.status) this.setStatus(head.status);
  }

  complain(problem) {
    this.alert.hidden = false;
    this.alert.textContent = problem;
    clearTimeout(this.timer);
    this.timer = setTimeout(() => {
      this.alert.hidden = this.open;
    }, 6000);
  }

  begin(trial) {
    this.trial = trial;
    this.result = null;
    this.transitions = [];
    this.changes = [];
    this.drawTransitions();
    this.drawChanges();
    document.title = trial.title;
    if (this.trialView) {
      this.trialView.restart(trial);
      this.clock.follow = true;
    }
  }

  append(columns) {
    if (!this.trialView) {
      this.seed = h('input', {
        type: 'text',
        inputmode: 'numeric',
        size: 6,
        value: this.trial.seed,
        'aria-label': 'seed',
      });
      const restart = () => this.line.send({do: 'restart', seed: this.seed.value.trim()});
      const controls = [
        button(
          'Step',
          () => {
            this.clock.follow = true;
            this.line.send({do: 'step'});
          },
          {title: 'let one frame pass (.)'},
        ),
        (this.now = button(
          'Now',
          () => {
            this.clock.follow = true;
            this.clock.seek(this.clock.end);
          },
          {title: 'follow the trial again'},
        )),
        h(
          'span',
          {class: 'restart'},
          h('label', {class: 'choice'}, h('span', {}, 'seed'), this.seed),
          button('Restart', restart, {
            title: 'begin again with this seed and the settings as they are',
          }),
          button(
            'Next seed',
            () => {
              this.seed.value = String(BigInt(this.trial.seed) + 1n);
              restart();
            },
            {title: 'begin again with the next seed'},
          ),
        ),
      ];
      fill(this.view);
      const view = (this.trialView = new TrialView(this.view, this.trial, {
        series: new Series(columns),
        clock: this.clock,
        controls,
        withHead: false,
        live: true,
      }));
      addEventListener('keydown', event => {
        if (event.key === '.' && !event.target.closest?.('input, select, textarea')) {
          this.clock.follow = true;
          this.line.send({do: 'step'});
        }
      });
      view.left.append(this.knobs.element);
      view.scene?.ready.then(() => {
        if (!view.scene.renderer) return;
        this.push = new Push(view.scene, force =>
          this.line.send({do: 'push', force_newton: force}),
        );
        view.scene.element.after(this.push.element);
      });
    } else {
      this.trialView.append(columns);
    }
  }

  showPictures(frame, {left, right}) {
    const view = this.trialView;
    if (!view) return;
    const {series, cameras} = view;
    for (const [side, bitmap] of [
      ['left', left],
      ['right', right],
    ]) {
      this.bitmaps ||= {};
      this.bitmaps[side]?.close();
      this.bitmaps[side] = bitmap;
      cameras.setPicture(side, bitmap);
    }
    cameras.setEstimate(
      series.pose('est', frame),
      series.at('fitness', frame) >= this.trial.limits.detection_fitness,
    );
    const now = performance.now();
    this.shown = this.shown.filter(time => time > now - 1000).concat(now);
    cameras.say(`Picture of ${clockText(frame / this.trial.frames_per_second)} with its estimate.`);
    document.documentElement.dataset.pictures = String(
      Number(document.documentElement.dataset.pictures || 0) + 1,
    );
  }

  setStatus(status) {
    this.status = status;
    const clock = this.clock;
    const playing = status.going && !status.ended;
    if (
      status.ended !== clock.ended ||
      (!status.ended && playing !== clock.playing) ||
      status.speed !== clock.speed
    ) {
      clock.ended = status.ended;
      this.clock.playing = playing;
      this.clock.speed = status.speed;
      this.trialView?.setSpeed(status.speed);
      this.clock.tell();
    }
    const seed = this.trial.seed;
    if (this.seed && seed !== this.knownSeed && document.activeElement !== this.seed)
      this.seed.value = seed;
    this.knownSeed = seed;
    this.drawHead();
  }

  /** At most a few times a second: it is text for people. */
  drawHead() {
    if (this.headDue) return;
    this.headDue = setTimeout(() => {
      this.headDue = null;
      this.drawHeadNow();
    }, 200);
  }
  drawHeadNow() {
    const {status, trial} = this;
    if (!trial) return;
    const state = !this.open
      ? 'gone'
      : status.ended
        ? status.outcome
        : status.going
          ? 'running'
          : 'paused';
    const seconds = (status.frames || 0) / trial.frames_per_second;
    const tone = status.ended ? undefined : this.open ? 'none' : 'bad';
    if (this.now) this.now.setAttribute('aria-pressed', String(this.clock.follow));
    const pictures = this.shown.filter(time => time > performance.now() - 1000).length;
    const text = [
      state,
      seconds,
      status.real_time_factor,
      pictures,
      status.reason,
      status.digest,
      this.changes.length,
    ].join();
    if (text === this.headText) return;
    this.headText = text;
    fill(
      this.head,
      h(
        'div',
        {class: 'head-title'},
        h('h1', {}, trial.description),
        badge(state, tone),
        h('span', {class: 'note'}, `seed ${trial.seed}`),
      ),
      status.reason ? h('p', {class: 'reason'}, status.reason) : null,
      facts(
        [
          ['simulated', clockText(seconds)],
          [
            'of real time',
            `${fixed(status.real_time_factor, 2)} ×`,
            'simulated over passed time, of the last second that it ran',
          ],
          ['pictures', `${pictures} /s`, 'pairs shown here in the last second'],
          ['changes', String(this.changes.length), 'settings changed and pushes while it ran'],
          status.digest ? ['digest', status.digest, 'equal for equal trials'] : null,
        ].filter(Boolean),
      ),
    );
  }

  addTransitions(list) {
    this.transitions.push(...list);
    this.drawTransitions();
  }
  drawTransitions() {
    const rate = this.trial.frames_per_second;
    fill(
      this.stages,
      h('h2', {}, 'Stages'),
      this.transitions.length
        ? h(
            'ol',
            {class: 'stages'},
            this.transitions.map(change => {
              const at = change.frame / rate;
              return h(
                'li',
                {},
                button(
                  clockText(at),
                  () => {
                    this.clock.follow = false;
                    this.clock.seek(at);
                  },
                  {class: 'link', title: `look at ${clockText(at)}`},
                ),
                h('span', {}, ` ${words(change.from)} → ${words(change.to)}: ${change.reason}`),
              );
            }),
          )
        : h('p', {class: 'note'}, 'None yet.'),
    );
  }

  addChanges(list) {
    this.changes.push(...list);
    this.drawChanges();
    this.drawHead();
  }
  drawChanges() {
    const last = this.changes.slice(-kShownChanges).reverse();
    fill(
      this.record,
      h('h2', {}, 'Changed while it ran'),
      last.length
        ? [
            h(
              'p',
              {class: 'note'},
              `${this.changes.length} in all, the last ones first; the trial’s record has every one of them.`,
            ),
            h(
              'div',
              {class: 'scroll', tabindex: 0, role: 'region', 'aria-label': 'changes'},
              h(
                'table',
                {class: 'plain'},
                h(
                  'tbody',
                  {},
                  last.map(change =>
                    h(
                      'tr',
                      {},
                      h('td', {class: 'numeric'}, `${fixed(change.time_s, 2)} s`),
                      h('th', {scope: 'row'}, change.key),
                      h('td', {}, change.key === 'push' ? `${change.value} N` : change.value),
                    ),
                  ),
                ),
              ),
            ),
          ]
        : h('p', {class: 'note'}, 'Nothing: its digest is that of a trial that nobody watched.'),
    );
  }
}
