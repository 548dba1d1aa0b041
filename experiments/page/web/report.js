// A report: verdict, facts, and sections of sentences, tables and plots that the program laid out
// (experiments/report/report.h). Knows no study.

import {h, fill, section, whenVisible} from 'page/dom.js';
import {load} from 'page/data.js';
import {Clock} from 'page/clock.js';
import {badge, command, facts, head, plainTable} from 'page/parts.js';
import {Plot, Sync} from 'page/plot.js';
import {Series} from 'page/series.js';
import {TrialView} from 'page/trial.js';

const listed = list => list.map(({label, value, note}) => [label, value, note]);

export function show(host, model) {
  const {verdict} = model;
  host.append(
    head({
      badge: verdict ? badge(verdict.word, verdict.tone) : null,
      title: model.title,
      reason: verdict?.reason,
      facts: model.facts.length ? listed(model.facts) : null,
    }),
    ...model.missing.map(text => h('p', {class: 'missing'}, text)),
  );
  const detail = h('div', {class: 'column', id: 'linked'});
  const view = {model, plots: [], open: id => openLink(model.links[id], detail)};
  host.append(
    h(
      'div',
      {class: 'cards'},
      model.sections.map(part => drawSection(part, view)),
    ),
    detail,
  );
  return view;
}

function drawSection(part, view) {
  const box = section(part.title, {note: part.note, wide: part.wide});
  if (part.lines)
    box.append(
      h(
        'ul',
        {},
        part.lines.map(line => h('li', {}, line)),
      ),
    );
  if (part.table) box.append(plainTable(linked(part.table, view)));
  if (part.panels) box.append(drawPanels(part, view));
  for (const {what, command: text} of part.commands || []) box.append(command(text, what));
  return box;
}

/** The table with what its links open. */
function linked({columns, rows}, {model, open}) {
  const cell = value =>
    model.links[value?.link]
      ? {...value, title: `show ${value.text}`, onclick: () => open(value.link)}
      : value;
  return {columns, rows: rows.map(row => row.map(cell))};
}

const kHeight = 250;

function drawPanels(part, view) {
  const sync = part.stacked ? new Sync() : null;
  const several = part.wide && part.panels.length > 1 && !part.stacked;
  return h(
    'div',
    {class: several ? 'plots two' : 'plots'},
    part.panels.map(panel => {
      const cell = h('div', {style: {minHeight: `${kHeight + 30}px`}});
      whenVisible(cell, () =>
        view.plots.push(
          new Plot(cell, panel, {
            height: kHeight,
            points: true,
            onPick: (series, i) => series.links && view.open(series.links[i]),
            ...(sync ? {sync} : {}),
          }),
        ),
      );
      return cell;
    }),
  );
}

/** The trials of a link below the report, on one clock that stands where the first of them ends. */
async function openLink(link, detail) {
  if (!link) return;
  const clock = new Clock();
  const box = h('div', {class: 'column', tabindex: -1});
  fill(detail, box);
  box.append(section(link.title, {wide: true, note: link.note}));
  const ends = [];
  for (const trial of link.trials) {
    box.append(
      section(
        trial.title,
        {wide: true},
        h(
          'div',
          {class: 'head-title'},
          badge(trial.outcome),
          h('span', {class: 'reason'}, trial.reason),
        ),
        facts(listed(trial.facts)),
        trial.commands.map(({what, command: text}) => command(text, what)),
        trial.note ? h('p', {class: 'note'}, trial.note) : null,
      ),
    );
    const model = trial.model ? await load(trial.model) : null;
    const columns = trial.series ? await load(trial.series) : model?.series;
    if (!model || !columns) continue;
    const options = {series: new Series(columns), frames: model.frames, clock, withHead: false};
    ends.push(new TrialView(box, {...model, record: null}, options).series.end);
  }
  if (ends.length) {
    clock.setEnd(Math.max(...ends));
    clock.seek(Math.max(0, Math.min(...ends) - 0.5));
  }
  box.scrollIntoView({block: 'start'});
  box.focus({preventScroll: true});
}
