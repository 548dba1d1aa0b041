// What can be set while a trial runs: sliders, switches and choices, as the program offers them.

import {h, choice, fill, section} from 'page/dom.js';
import {measured, number, words} from 'page/format.js';

const kSteps = 200; // of a slider: values that a person can say again

export class Knobs {
  /** send(command) sets a key. */
  constructor(send) {
    this.send = send;
    this.body = h('div', {class: 'knobs'});
    const note = 'From the next frame on; the record says when and what.';
    this.element = section('Change what happens', {note}, this.body);
    this.element.classList.add('hands');
  }

  /** controls: what the program offers, with values. */
  set(controls) {
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

function slider({label, unit, low, high, factor = 1}, set) {
  let isHeld = false;
  const output = h('output');
  const say = now => {
    fill(output, measured(number(factor * now, 3), unit));
    input.setAttribute('aria-valuetext', output.textContent);
  };
  const oninput = () => {
    isHeld = true;
    say(Number(input.value));
  };
  const onchange = () => {
    isHeld = false;
    set(Number(input.value));
  };
  const range = {type: 'range', min: low, max: high, step: (high - low) / kSteps};
  const input = h('input', {...range, 'aria-label': `${label}, ${unit}`, oninput, onchange});
  return {
    element: h('label', {}, h('span', {}, label), input, output),
    show: now => {
      if (isHeld) return;
      input.max = Math.max(now, input.max);
      input.min = Math.min(now, input.min);
      input.value = now;
      say(now);
    },
  };
}
