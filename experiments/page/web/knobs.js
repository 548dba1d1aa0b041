// What can be set while a trial runs: sliders, switches and choices, as the program offers them.

import {h, button, choice, fill, section} from 'page/dom.js';
import {number, words} from 'page/format.js';

const kSendEvery_ms = 100;
const kHeld_ms = 500; // after a slider was let go: what the program says then may be older
const kSteps = 200; // of a slider: values that a person can say again

export class Knobs {
  /** send(command) sets a key. */
  constructor(send) {
    this.send = send;
    this.first = null; // values that the first trial began with
    this.body = h('div', {class: 'knobs'});
    const note = 'From the next frame on; the record says when and what.';
    const reset = button('As at first', () => this.backToFirst(), {
      title: 'set everything as it was when the program began',
    });
    this.element = section('Change what happens', {note}, this.body, h('div', {}, reset));
  }

  /** controls: what the program offers, with values. */
  set(controls) {
    this.first ||= new Map(controls.map(({key, value}) => [key, value]));
    const keys = list => list?.map(({key}) => key).join(' ');
    if (keys(controls) !== keys(this.controls)) this.build(controls);
    this.controls = controls;
    for (const {key, value} of controls) this.show.get(key)(value);
  }

  build(controls) {
    this.show = new Map(); // key → what shows a value
    const groups = [...new Set(controls.map(({group}) => group))];
    fill(
      this.body,
      groups.map(group =>
        h(
          'fieldset',
          {},
          h('legend', {}, group[0].toUpperCase() + group.slice(1)),
          controls.filter(control => control.group === group).map(control => this.knob(control)),
        ),
      ),
    );
  }

  knob(control) {
    const {key, choices} = control;
    const set = value => this.sendValue(control, value);
    const make = !choices ? slider : choices.join() === 'false,true' ? toggle : menu;
    const {element, show} = make(control, set);
    this.show.set(key, show);
    element.classList.add('knob');
    element.title = key;
    return element;
  }

  sendValue({key, list_of: count}, value) {
    this.send({do: 'set', key, value: count ? Array(count).fill(value) : value});
  }
  backToFirst() {
    for (const control of this.controls) {
      const value = this.first.get(control.key);
      if (value !== undefined && value !== control.value) this.sendValue(control, value);
    }
  }
}

function toggle({label}, set) {
  const box = h('input', {type: 'checkbox', onchange: () => set(box.checked)});
  return {
    element: h('label', {class: 'switch'}, box, h('span', {}, label)),
    show: value => {
      box.checked = value === 'true';
    },
  };
}

function menu({label, choices, value}, set) {
  const options = choices.map(name => [name, words(name)]);
  const element = choice(label, options, value, set);
  return {
    element,
    show: now => {
      element.querySelector('select').value = now;
    },
  };
}

function slider({label, unit, low, high}, set) {
  let isHeld = false;
  let due = null; // what is still to be sent
  let sent_ms = -Infinity;
  const output = h('output');
  const say = value => {
    fill(output, `${number(value, 3)} ${unit}`);
    input.setAttribute('aria-valuetext', output.textContent);
  };
  const oninput = () => {
    isHeld = true;
    const step = (high - low) / kSteps;
    const value = Number((Math.round(Number(input.value) / step) * step).toPrecision(6));
    say(value);
    clearTimeout(due);
    const send = () => {
      sent_ms = performance.now();
      set(value);
    };
    const wait_ms = kSendEvery_ms - (performance.now() - sent_ms);
    if (wait_ms <= 0) send();
    else due = setTimeout(send, wait_ms);
  };
  const onchange = () =>
    setTimeout(() => {
      isHeld = false;
    }, kHeld_ms);
  const range = {type: 'range', min: low, max: high, step: 'any'};
  const input = h('input', {...range, 'aria-label': `${label}, ${unit}`, oninput, onchange});
  return {
    element: h('label', {}, h('span', {}, label), input, output),
    show: value => {
      if (isHeld) return;
      input.max = Math.max(value, input.max);
      input.min = Math.min(value, input.min);
      input.value = value;
      say(value);
    },
  };
}
