// One trial: how it ended, what happened, in plots, pictures and 3D. The live page feeds the same view.

import {h, button, choice, section} from 'page/dom.js';
import {addressOf} from 'page/data.js';
import {clockText, fixed, number, quantity, shown, words} from 'page/format.js';
import {Cameras} from 'page/cameras.js';
import {Clock} from 'page/clock.js';
import {Scene3d} from 'page/scene3d.js';
import {Series} from 'page/series.js';
import {Traces, stageSpans} from 'page/traces.js';
import {badge, facts, command, head, plainTable} from 'page/parts.js';

export const title = model => model.title;

const kLiveEvery_ms = 150; // between two drawings of growing traces

/** What main.js calls for a trial's report. */
export function show(host, model) {
  const view = new TrialView(host, model, {
    series: new Series(model.series),
    frames: model.frames,
    video: addressOf('video', 'video/mp4'),
  });
  const spans = stageSpans(view.series, model.stages);
  const last = spans[spans.length - 1];
  view.clock.seek(last ? Math.max(0, view.series.end - 0.5) : 0);
  return view;
}

export class TrialView {
  /** options: {series, frames: key frames, video: its address, clock, controls: elements for the bar,
   *  withHead: false without, live: rows and pictures come as the trial goes on} */
  constructor(
    host,
    model,
    {
      series = new Series(),
      frames = [],
      video = null,
      clock = new Clock(),
      controls = [],
      withHead = true,
      live = false,
    } = {},
  ) {
    Object.assign(this, {model, series, frames, clock, live});
    if (withHead) this.drawHead(host);
    this.transport(host, controls);
    const left = (this.left = h('div', {class: 'column view'}));
    const right = h('div', {class: 'column plots-of-trial'});
    const rest = h('div', {class: 'column rest'});
    host.append(h('div', {class: 'trial-grid'}, left, right, rest));
    if (model.scene) {
      const box = section(live ? '3D' : '3D replay', {level: 2});
      left.append(box);
      this.scene = new Scene3d(box, model);
      this.scene.ready.then(() => {
        this.scene.setSeries(this.series);
        this.show();
      });
    }
    const box = section(video ? 'Cameras, filmed' : 'Cameras', {level: 2});
    left.append(box);
    if (video) this.film(box, video);
    else this.cameras = new Cameras(box, model);
    const plots = section('What happened', {level: 2});
    right.append(plots);
    this.traces = new Traces(plots, model, series, clock);
    this.clock.setEnd(series.end);
    clock.on(() => this.show());
    this.show();
    if (withHead) this.drawRest(host, rest);
  }

  /** Rows that came after; the same columns. */
  append(columns) {
    this.series.append(columns);
    this.clock.setEnd(this.series.end);
    this.updateSoon();
  }
  updateSoon() {
    if (this.pending) return;
    this.pending = true;
    const soon = this.live ? f => setTimeout(f, kLiveEvery_ms) : requestAnimationFrame;
    soon(() => {
      this.pending = false;
      if (!this.series.length) return;
      this.traces.update();
      this.scene?.setSeries(this.series);
      this.show();
    });
  }

  /** Another trial of the same scenario begins: its rows will follow. */
  restart(model) {
    this.model = model;
    this.series.clear();
    this.clock.setEnd(0);
    this.clock.seek(0);
  }

  drawHead(host) {
    const record = this.model.record;
    if (!record) return;
    const e = record.final_error_true || {};
    host.append(
      head({
        badge: badge(record.outcome),
        title: this.model.description,
        reason: record.reason,
        note: `seed ${this.model.seed}`,
        facts: [
          ['time', clockText(record.time_s)],
          [
            'true error',
            ['x_m', 'y_m', 'z_m'].map(k => fixed(e[k] * 1000, 0)).join(', ') + ' mm',
            'of x, y and z at that time',
          ],
          ['yaw', `${fixed((e.yaw_rad * 180) / Math.PI, 1)}°`, 'true error at that time'],
          ['F, mean', fixed(record.fitness_mean, 2), 'fitness over all frames'],
          [
            'pole in',
            `${fixed(record.insertion_depth_m * 1000, 0)} mm`,
            'depth of the pole’s tip past the dock’s mouth, at the end',
          ],
          ['returns', String(record.returns_to_servoing), 'from docking to visual servoing'],
        ],
      }),
    );
    if (this.model.missing?.length)
      host.append(
        h(
          'ul',
          {class: 'missing'},
          this.model.missing.map(text => h('li', {}, text)),
        ),
      );
  }

  drawRest(host, rest) {
    const {model} = this;
    const record = model.record;
    if (record?.transitions?.length)
      rest.append(
        section(
          'Stages',
          {},
          h(
            'ol',
            {class: 'stages'},
            record.transitions.map(change => {
              const at = change.frame / model.frames_per_second;
              return h(
                'li',
                {},
                button(
                  clockText(at),
                  () => {
                    this.clock.pause();
                    this.clock.seek(at);
                  },
                  {class: 'link', title: `go to ${clockText(at)}`},
                ),
                h('span', {}, ` ${words(change.from)} → ${words(change.to)}: ${change.reason}`),
              );
            }),
          ),
        ),
      );
    rest.append(
      section(
        'Settings that differ',
        {note: 'From what every scenario begins with.'},
        model.settings?.length
          ? plainTable({
              columns: [{label: 'key'}, {label: 'here'}, {label: 'default'}],
              caption: '',
              rows: model.settings.map(s => [
                {text: s.key, title: s.doc},
                s.value,
                s.default || '–',
              ]),
            })
          : h('p', {}, 'None.'),
      ),
    );
    if (model.commands)
      rest.append(
        section(
          'Again',
          {},
          model.commands.map(c => command(c.command, c.what)),
        ),
      );
    if (record) host.append(section('All figures', {}, facts(flat(record))));
  }

  transport(host, controls) {
    const clock = this.clock;
    this.play = button('▶ Play', () => clock.toggle(), {
      class: 'play',
      title: 'play or pause (space)',
    });
    this.slider = h('input', {
      type: 'range',
      min: 0,
      max: 1,
      step: 'any',
      value: 0,
      'aria-label': 'time in the trial',
      oninput: () => {
        const time = Number(this.slider.value); // pausing shows the old time again
        clock.pause();
        clock.follow = false;
        clock.seek(time);
      },
    });
    this.now = h('output', {class: 'now'});
    const speeds = [0.25, 0.5, 1, 2, 4, 8];
    const speed = choice(
      'speed',
      speeds.map(s => [String(s), `${s}×`]),
      '1',
      value => clock.setSpeed(Number(value)),
    );
    this.speed = speed.querySelector('select');
    this.bar = h(
      'div',
      {class: 'transport', role: 'group', 'aria-label': 'time'},
      this.play,
      this.slider,
      this.now,
      speed,
      controls,
    );
    host.append(this.bar);
    addEventListener('keydown', event => {
      if (
        event.key !== ' ' ||
        event.defaultPrevented ||
        !this.bar.isConnected ||
        event.target.closest?.('button, input, select, textarea, video, [role=table]')
      )
        return;
      event.preventDefault();
      clock.toggle();
    });
  }

  /** Shows a speed that was set elsewhere. */
  setSpeed(factor) {
    if (document.activeElement !== this.speed) this.speed.value = String(factor);
  }

  film(host, address) {
    this.video = h('video', {
      src: address,
      muted: true,
      playsinline: true,
      preload: 'auto',
      tabindex: -1,
      'aria-label': 'film: left and right camera with the estimated marker',
    });
    this.video.muted = true;
    host.append(h('div', {class: 'film'}, this.video));
    this.video.addEventListener('loadedmetadata', () => this.showFilm());
  }
  showFilm() {
    const {video, clock} = this;
    if (!video?.duration) return;
    const time = Math.min(clock.time, video.duration - 0.01);
    video.playbackRate = Math.min(8, Math.max(0.1, clock.speed));
    if (clock.playing && time < video.duration - 0.05) {
      if (video.paused) {
        video.currentTime = time;
        video.play().catch(() => {});
      } else if (Math.abs(video.currentTime - time) > 0.25 * Math.max(1, clock.speed))
        video.currentTime = time;
    } else {
      video.pause();
      if (Math.abs(video.currentTime - time) > 0.01) video.currentTime = time;
    }
  }

  /** Everything at the clock's time. */
  show() {
    const {clock, series} = this;
    const i = series.indexAt(clock.time);
    const play = clock.playing ? '❚❚ Pause' : '▶ Play';
    if (this.play.textContent !== play) this.play.textContent = play;
    this.slider.max = String(Math.max(clock.end, 0.001));
    this.slider.value = String(clock.time);
    const stage = series.at('stage', i);
    const F = series.at('fitness', i);
    this.slider.setAttribute('aria-valuetext', `${clockText(clock.time)}, ${words(stage || '')}`);
    const ended = clock.time > series.end + 0.1; // another trial of the same clock goes on
    this.now.textContent =
      i < 0
        ? '–'
        : `${clockText(ended ? series.end : clock.time)} · ${words(stage)} · ${ended ? 'ended' : `F ${fixed(F, 2)}`}`;
    if (i < 0) return;
    const found = F >= this.model.limits.detection_fitness;
    this.scene?.update(
      series.pose('vehicle', i),
      series.pose('true', i),
      found ? series.pose('est', i) : null,
    );
    if (this.video) this.showFilm();
    if (this.cameras && !this.live) this.showFrame();
  }

  /** The picture nearest to the time, with its own estimate. */
  showFrame() {
    const {frames, series, clock, cameras} = this;
    if (!frames?.length) {
      const i = series.indexAt(clock.time);
      cameras.setEstimate(
        series.pose('est', i),
        series.at('fitness', i) >= this.model.limits.detection_fitness,
      );
      cameras.say('No pictures were kept; the circles are the estimate.');
      return;
    }
    let best = frames[0];
    for (const frame of frames)
      if (Math.abs(frame.time_s - clock.time) < Math.abs(best.time_s - clock.time)) best = frame;
    if (best === this.frame) return;
    this.frame = best;
    for (const side of ['left', 'right']) {
      const image = new Image();
      image.onload = () => {
        if (this.frame === best) cameras.setPicture(side, image);
      };
      image.src = 'data:image/jpeg;base64,' + best[side];
    }
    const i = series.indexAt(best.time_s);
    cameras.setEstimate(
      series.pose('est', i),
      series.at('fitness', i) >= this.model.limits.detection_fitness,
    );
    cameras.say(
      `Picture of ${clockText(best.time_s)} with its estimate; ${frames.length} pictures kept.`,
    );
  }
}

/** A record's values with their keys dotted: [[label, text, key]]. */
export function flat(record, path = '') {
  const list = [];
  for (const [key, value] of Object.entries(record)) {
    const name = path ? `${path}.${key}` : key;
    if (['transitions', 'reason', 'log'].includes(key)) continue;
    if (value && typeof value === 'object' && !Array.isArray(value))
      list.push(...flat(value, name));
    else {
      const {unit, factor} = quantity(path.endsWith('_s') ? path : key); // stage_time_s.docking
      const text =
        typeof value === 'number'
          ? `${number(value * factor)}${unit ? ' ' + unit : ''}`
          : Array.isArray(value)
            ? value.map(shown).join(', ') || 'none'
            : shown(value);
      list.push([
        words(name.replace(/_(m|s|rad|v|newton|joule)(?=\.|$)/g, '')).replaceAll('.', ', '),
        text,
        name,
      ]);
    }
  }
  return list;
}
