// A report: verdict, facts, and sections of sentences, tables and plots that the program laid out
// (experiments/report/report.h). Knows no study.

import {h, section} from 'page/dom.js';
import {badge, command, head, plainTable, scrolled} from 'page/parts.js';
import {Plot, Sync} from 'page/plot.js';
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

/** All sections and, below them, what their links open. */
export function drawSections(host, model) {
  const detail = h('div', {id: 'linked'});
  const view = {
    model,
    plots: [],
    open: id => model.links[id] && openTrials(detail, model.links[id]),
  };
  const sections = model.sections.map(part => drawSection(part, view));
  for (const [name, jpeg] of Object.entries(model.pictures || {}))
    sections.push(
      section(
        `What the cameras saw: ${name}`,
        {wide: true},
        scrolled(
          `images, ${name}`,
          h('img', {src: `data:image/jpeg;base64,${jpeg}`, alt: `sheet of images, ${name}`}),
        ),
      ),
    );
  host.append(h('div', {class: 'cards'}, sections), detail);
  return view;
}

function drawSection(part, view) {
  const {title, note, lines, table, panels, stacked, commands = []} = part;
  const wide = part.wide || Boolean(table);
  return section(
    title,
    {note, wide},
    lines?.length
      ? h(
          'ul',
          {},
          lines.map(line => h('li', {}, line)),
        )
      : null,
    table ? plainTable(linked(table, view)) : null,
    panels?.length ? drawPanels(panels, {stacked, wide}, view) : null,
    commands.map(command),
  );
}

/** The table with what its links open. */
function linked({columns, rows}, {model, open}) {
  const cell = value =>
    model.links[value?.link]
      ? {...value, title: `show ${value.text}`, onclick: () => open(value.link)}
      : value;
  return {columns, rows: rows.map(row => row.map(cell))};
}

function drawPanels(panels, {stacked, wide}, view) {
  const sync = stacked ? new Sync() : null;
  const isBroad = wide && panels.length > 1 && !stacked;
  return h(
    'div',
    {class: stacked ? 'traces' : isBroad ? 'plots two' : 'plots'},
    panels.map(panel => {
      const height = panel.has_axes === false ? 24 : stacked ? 150 : kHeight;
      const cell = h('div');
      const onPick = panel.series.some(series => series.links?.length)
        ? (series, i) => view.open(series.links?.[i])
        : null;
      view.plots.push(new Plot(cell, panel, {height, onPick, sync}));
      return cell;
    }),
  );
}
