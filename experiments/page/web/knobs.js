// What can be set while a trial runs: sliders, switches and choices, as the program offers them.

import {h, button, choice, section} from 'page/dom.js';
import {number, words} from 'page/format.js';

const kGroups = [
  ['water', 'Water'],
  ['sea', 'Sea'],
  ['light', 'Light'],
  ['control', 'Control'],
];
const kSendEvery_ms = 100;

export class Knobs {
  /** send(command) sets a key. */
  constructor(send) {
    this.send = send;
    this.held = new Map(); // keys that a hand is on, and what is still to be sent of them
    this.first = null; // values that the first trial began with
    this.body = h('div', {class: 'knobs'});
    this.reset = button('As at first', () => this.backToFirst(), {
      title: 'set everything as it was when the program began',
    });
    this.element = section(
      'Change what happens',
      {note: 'From the next frame on; the record says when and what.'},
      this.body,
      h('div', {}, this.reset),
    );
  }

  /** controls: what the program offers, with values. */
  set(controls) {
    this.controls = controls;
    this.first ||= new Map(controls.map(control => [control.key, control.value]));
    const shape = controls.map(control => control.key).join(' ');
    if (shape !== this.shape) this.build(shape);
    for (const control of controls) this.knobs.get(control.key).show(control.value);
  }

  build(shape) {
    this.shape = shape;
    this.knobs = new Map();
    this.body.replaceChildren(
      ...kGroups.map(([group, title]) =>
        h(
          'fieldset',
          {},
          h('legend', {}, title),
          this.controls
            .filter(control => control.group === group)
            .map(control => this.knob(control)),
        ),
      ),
    );
  }

  knob(control) {
    const {key, label} = control;
    const set = value =>
      this.send({
        do: 'set',
        key,
        value: control.list_of ? Array(control.list_of).fill(value) : value,
      });
    if (control.choices) {
      if (control.choices.join() === 'false,true') {
        const box = h('input', {type: 'checkbox', onchange: () => set(box.checked)});
        this.knobs.set(key, {
          show: value => {
            box.checked = value === 'true';
          },
        });
        return h('label', {class: 'knob switch', title: key}, box, h('span', {}, label));
      }
      const element = choice(
        label,
        control.choices.map(name => [name, words(name)]),
        control.value,
        set,
      );
      element.classList.add('knob');
      element.title = key;
      const select = element.querySelector('select');
      this.knobs.set(key, {
        show: value => {
          select.value = value;
        },
      });
      return element;
    }
    const text = value => `${number(value, 3)} ${control.unit}`;
    const output = h('output', {}, '');
    const slider = h('input', {
      type: 'range',
      min: control.low,
      max: control.high,
      step: 'any',
      'aria-label': `${label}, ${control.unit}`,
    });
    const say = value => {
      output.textContent = text(value);
      slider.setAttribute('aria-valuetext', text(value));
    };
    let due = null;
    let held = false;
    slider.addEventListener('input', () => {
      held = true;
      // whole steps of a two-hundredth: values that a person can say again
      const step = (control.high - control.low) / 200;
      const value = Number((Math.round(Number(slider.value) / step) * step).toPrecision(6));
      say(value);
      clearTimeout(due?.timer);
      const send = () => {
        due = {at: performance.now()};
        set(value);
      };
      const wait = due ? kSendEvery_ms - (performance.now() - due.at) : 0;
      if (wait <= 0) send();
      else due.timer = setTimeout(send, wait);
    });
    slider.addEventListener('change', () => {
      setTimeout(() => {
        held = false;
      }, 500);
    });
    this.knobs.set(key, {
      show: value => {
        if (held) return;
        if (value > Number(slider.max)) slider.max = value;
        if (value < Number(slider.min)) slider.min = value;
        slider.value = value;
        say(value);
      },
    });
    return h('label', {class: 'knob', title: key}, h('span', {}, label), slider, output);
  }

  backToFirst() {
    for (const control of this.controls) {
      const value = this.first.get(control.key);
      if (value === undefined || value === control.value) continue;
      this.send({
        do: 'set',
        key: control.key,
        value: control.list_of ? Array(control.list_of).fill(value) : value,
      });
    }
  }
}
