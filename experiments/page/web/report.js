// A report: verdict, facts, and sections of sentences, tables and plots that the program laid out
// (experiments/report/report.h). Knows no study.

import {h, section} from 'page/dom.js';
import {badge, command, facts, head, plainTable, reveal, scrolled} from 'page/parts.js';
import {Plot, Sync} from 'page/plot.js';
import {Stack} from 'page/stack.js';
import {openTrials} from 'page/trial.js';

const kHeight = 250; // of a plot, in pixels

export function show(host, model) {
  drawHead(host, model);
  return drawSections(host, model);
}

export function drawHead(host, {verdict, title, facts, missing}) {
  const mark = verdict?.word ? badge(verdict.word, verdict.tone) : null;
  host.append(...head({badge: mark, title, reason: verdict?.reason, facts, missing}));
}

/**
 * All sections and, below them, what their links open. players: see drawSection. openers: other links, each a function
 * by the first word of its id ("trial" of "trial 7"), which is given the rest.
 */
export function drawSections(host, model, players = {}, openers = {}) {
  const detail = h('div', {id: 'linked'});
  const {links = {}} = model;
  const openerOf = id => openers[String(id).split(' ')[0]];
  const view = {
    model,
    players,
    plots: [],
    open: id => {
      if (placeOf(id, model)) goTo(id);
      else if (links[id]) openTrials(detail, links[id]);
      else openerOf(id)?.(id.split(' ')[1]);
    },
    isLink: id => Boolean(links[id] || openerOf(id) || placeOf(id, model)),
  };
  const ground = h('div', {class: 'cards'});
  host.append(ground, detail);
  ground.append(...model.sections.map(part => drawSection(part, view)).filter(Boolean));
  for (const [name, jpeg] of Object.entries(model.pictures || {}))
    ground.append(
      section(
        `What the cameras saw: ${name}`,
        {wide: true},
        scrolled(
          `images, ${name}`,
          h('img', {src: `data:image/jpeg;base64,${jpeg}`, alt: `sheet of images, ${name}`}),
        ),
      ),
    );
  return view;
}

/** "#TITLE#WORDS" is a section of the page and, in it, the first row with these words. */
const placeOf = (id, {sections}) =>
  String(id).startsWith('#') &&
  sections.find(({title, table}) => table && title === id.split('#')[1]);

function goTo(id) {
  const [, title, words] = id.split('#');
  const place = document.querySelector(`section[aria-label="${title}"]`);
  const rows = [...place.querySelectorAll('tbody tr')];
  reveal(rows.find(row => row.textContent.includes(words)) || place);
}

/**
 * view: {plots: filled with those drawn, open(id), isLink(id), players: by name, functions that fill a section and
 * return false where they have nothing to show, sync: of stacked panels, if it has one}. Null for a section in which
 * nothing would stand.
 */
export function drawSection(part, view) {
  const {title, note, lines, table, panels, stacked, player, commands = []} = part;
  const wide = part.wide || Boolean(table);
  const play = view.players?.[player];
  if (play) {
    const box = section(title, {note, wide});
    return play(box) === false ? null : box;
  }
  const content = [
    lines?.length
      ? h(
          'ul',
          {},
          lines.map(line => h('li', {}, line)),
        )
      : null,
    part.facts?.length ? facts(part.facts) : null,
    panels?.length ? drawPanels(panels, {stacked, wide}, view) : null,
    table ? plainTable(linked(table, view)) : null,
    commands.length ? commands.map(command) : null,
  ].filter(Boolean);
  return player && !content.length ? null : section(title, {note, wide}, content);
}

/** The table with what its links open. */
function linked({columns, rows}, view) {
  const cell = value =>
    view.isLink(value?.link)
      ? {...value, title: `show ${value.text}`, onclick: () => view.open(value.link)}
      : value;
  return {columns, rows: rows.map(row => row.map(cell))};
}

function drawPanels(panels, {stacked, wide}, view) {
  const ground = h('div');
  if (stacked) {
    view.stack = new Stack(ground, panels, view.sync || new Sync());
    view.plots.push(...view.stack.plots);
    return ground;
  }
  ground.className = wide && panels.length > 1 ? 'plots two' : 'plots';
  for (const panel of panels) {
    const rows = panel.y?.names?.length;
    const height = rows ? 50 + 24 * rows : panel.equal ? 360 : kHeight;
    const cell = h('div');
    const onPick = panel.series.some(series => series.links?.some(view.isLink))
      ? (series, i) => view.open(series.links[i])
      : null;
    view.plots.push(new Plot(cell, panel, {height, onPick}));
    if (onPick) cell.append(h('p', {class: 'note hint'}, 'A click shows what is behind a point.'));
    ground.append(cell);
  }
  return ground;
}
