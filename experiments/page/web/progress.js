// Trials while they run: the page of what there is, and above it how far they are.

import {h, button, fill} from 'page/dom.js';
import {number, percent, rate} from 'page/format.js';
import {Line} from 'page/socket.js';

const kGrowth = 1.05; // by how much there must be more to draw again
const kDrawEvery_ms = 5000;

export async function show(host, model) {
  const progress = new Progress(host, model);
  const body = h('div', {class: 'live-view'});
  host.append(body);
  const module = await import(`page/${model.shows}.js`);
  progress.view = await module.show(body, model);
  return progress;
}

/** "2:05 h", "3:10 min", "12 s". */
function duration(seconds) {
  const s = Math.round(seconds);
  const two = x => String(x).padStart(2, '0');
  if (s < 60) return `${s} s`;
  return s < 3600
    ? `${Math.floor(s / 60)}:${two(s % 60)} min`
    : `${Math.floor(s / 3600)}:${two(Math.floor(s / 60) % 60)} h`;
}

class Progress {
  constructor(host, model) {
    this.drawn = model.rows ?? 0;
    this.ran = model.running;
    this.begun = performance.now();
    this.bar = h(
      'div',
      {
        class: 'progress',
        role: 'progressbar',
        'aria-label': 'trials that are done',
        'aria-valuemin': 0,
      },
      h('span', {}),
    );
    this.text = h('p', {class: 'now', role: 'status'}, '…');
    this.fresh = button('', () => location.reload(), {title: 'draw the page again with them'});
    this.fresh.hidden = true;
    host.append(h('div', {class: 'transport'}, this.bar, this.text, this.fresh));
    // who works with the page is not to lose what he has filtered and picked
    for (const name of ['pointerdown', 'keydown', 'input'])
      addEventListener(
        name,
        event => {
          if (event.target.closest?.('main')) this.touched = true;
        },
        {capture: true},
      );
    this.line = new Line({
      onMessage: head => this.take(head.progress),
      onState: open => {
        this.open = open;
        this.draw();
      },
    });
  }

  take(progress) {
    this.progress = progress;
    this.draw();
    if (progress.problem) return;
    const more = progress.done - this.drawn;
    this.fresh.hidden = more <= 0;
    fill(this.fresh, `${more} more since: draw them`);
    const enough = more > 0 && (progress.done >= kGrowth * this.drawn + 1 || !progress.running);
    const ended = this.ran && !progress.running; // a study has its report now
    if ((enough || ended) && !this.touched && !document.hidden)
      setTimeout(
        () => {
          if (!this.touched) location.reload();
        },
        Math.max(0, kDrawEvery_ms - (performance.now() - this.begun)),
      );
  }

  draw() {
    const p = this.progress;
    if (!p) return;
    if (p.problem) {
      fill(this.text, p.problem);
      return;
    }
    const total = p.expected ?? p.wanted;
    const share = total ? Math.min(1, p.done / total) : 0;
    this.bar.hidden = !total;
    this.bar.firstChild.style.width = percent(share, 1).replace(' ', '');
    this.bar.setAttribute('aria-valuemax', total ?? 0);
    this.bar.setAttribute('aria-valuenow', p.done);
    const parts = [
      total
        ? `${p.done} of ${p.expected > p.wanted ? 'about ' : ''}${total} trials`
        : `${p.done} trials`,
    ];
    if (p.done) parts.push(`docked ${rate(p.successes / p.done, ...p.wilson)}`);
    if (p.by_hour && p.running) {
      parts.push(`${number(Math.round(p.by_hour), 3)} an hour`);
      if (total > p.done) parts.push(`${duration(((total - p.done) / p.by_hour) * 3600)} left`);
    }
    parts.push(
      !this.open
        ? 'this page is cut off: the program has ended'
        : p.running
          ? 'running'
          : total && p.done >= total
            ? 'complete'
            : 'not running',
    );
    fill(this.text, parts.join(' · '));
  }
}
