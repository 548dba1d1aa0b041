// Begins with what the document brings along: its model's kind names the module that shows it.

import {h, button} from 'page/dom.js';
import {load} from 'page/data.js';
import {startTheme, toggleTheme} from 'page/theme.js';

export async function start() {
  startTheme();
  const model = await load('model');
  const main = h('main', {id: 'main', class: `kind-${model.kind}`});
  document.body.append(
    h('a', {class: 'skip', href: '#main'}, 'To the content'),
    h(
      'nav',
      {class: 'top', 'aria-label': 'page'},
      h('strong', {}, 'turbidock'),
      h('span', {class: 'kind'}, model.kind_title || model.kind),
      h('span', {class: 'space'}),
      model.build ? h('span', {class: 'note build'}, model.build) : null,
      button('Light / dark', toggleTheme, {title: 'switch between light and dark'}),
    ),
    main,
  );
  try {
    const module = await import(`page/${model.kind}.js`);
    globalThis.turbidock = await module.show(main, model);
  } catch (error) {
    main.append(
      h('p', {class: 'missing', role: 'alert'}, `This page cannot be drawn: ${error.message}`),
    );
    throw error;
  }
  performance.mark('turbidock-ready');
  document.documentElement.dataset.ready = 'true';
}
