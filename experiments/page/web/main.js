// Begins with what the document brings along: its model's kind names the module that shows it.

import * as batch from 'page/batch.js';
import * as live from 'page/live.js';
import * as report from 'page/report.js';
import * as trial from 'page/trial.js';
import {h, button, fill} from 'page/dom.js';
import {load} from 'page/data.js';
import {words} from 'page/format.js';
import {setCurves, startTheme} from 'page/theme.js';

const kKinds = {batch, live, report, trial};

async function start() {
  startTheme();
  const model = await load('model');
  document.getElementById('plain').remove();
  setCurves(model.curves);
  const main = h('main', {id: 'main'});
  const news = h('span', {class: 'news', role: 'status'});
  document.body.append(
    h(
      'nav',
      {class: 'line top', 'aria-label': 'page'},
      h('strong', {}, 'turbidock'),
      h('span', {class: 'kind'}, words(model.kind_title || model.kind)),
      news,
      model.build ? h('span', {class: 'note build'}, model.build) : null,
    ),
    main,
  );
  try {
    globalThis.turbidock = await kKinds[model.kind].show(main, model);
  } catch (error) {
    const text = `This page cannot be drawn: ${error.message}`;
    main.append(h('p', {class: 'missing', role: 'alert'}, text));
    throw error;
  }
  if (model.again_s) keepFresh(news, model.again_s);
  performance.mark('turbidock-ready');
  document.documentElement.dataset.ready = 'true';
}

/**
 * Loads the page of what still runs again every so many seconds. Where somebody works with it, a button does instead.
 */
function keepFresh(news, every_s) {
  let isTouched = false;
  const touch = event => (isTouched ||= Boolean(event.target.closest?.('main')));
  for (const name of ['pointerdown', 'keydown', 'input'])
    addEventListener(name, touch, {capture: true});
  const again = button('running: draw it again', () => location.reload());
  fill(news, again);
  setInterval(async () => {
    if (document.hidden) return;
    const answer = await fetch(location.href).catch(() => null); // never an error's page instead of this one
    if (!answer) return fill(news, 'cut off: the program has ended');
    if (!answer.ok) return fill(news, await answer.text());
    if (!isTouched) location.reload();
    if (news.firstChild !== again) fill(news, again);
  }, 1000 * every_s);
}

start();
