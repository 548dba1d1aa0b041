// Pushes on the vehicle, by buttons.

import {h, button} from 'page/dom.js';
import {rotate} from 'page/series.js';

const kPush_newton = 5;
const kPush_ms = 600;
// in the vehicle's own axes: x ahead, y left, z up
const kWays = {
  ahead: [1, 0, 0],
  back: [-1, 0, 0],
  left: [0, 1, 0],
  right: [0, -1, 0],
  up: [0, 0, 1],
  down: [0, 0, -1],
};

export class Push {
  /** pose(): the vehicle's in the world; send(force): three numbers in N, in the world. */
  constructor(pose, send) {
    Object.assign(this, {pose, send});
    this.note = h('span', {class: 'note'});
    this.buttons = Object.keys(kWays).map(name =>
      button(name, () => this.push(kWays[name]), {title: `push ${name}, ${kPush_newton} N`}),
    );
    const label = {role: 'group', 'aria-label': 'push the vehicle'};
    this.element = h('div', {class: 'line', ...label}, this.note, this.buttons);
    this.stop('');
  }

  /** No pushing, for this reason; none: it may be pushed. */
  stop(why) {
    this.note.textContent = why || 'Push the vehicle:';
    for (const one of this.buttons) one.disabled = Boolean(why);
    clearTimeout(this.timer);
  }

  push(way) {
    clearTimeout(this.timer);
    const force = rotate(this.pose() || [0, 0, 0, 1, 0, 0, 0], way);
    this.send(force.map(x => Number((kPush_newton * x).toFixed(2))));
    this.timer = setTimeout(() => this.send([0, 0, 0]), kPush_ms);
  }
}
