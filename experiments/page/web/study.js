// A study, a comparison, a gate: sections of text, tables and plots that the program laid out.

import {h, section, whenVisible} from 'page/dom.js';
import {badge, command, head, plainTable} from 'page/parts.js';
import {Plot, Sync} from 'page/plot.js';

/**
 * model: {title, badge: {word, tone}, reason, facts: [[label, value, why]], missing: [text], sections:
 * [{title, note, wide, panels: [panel], columns, table: {columns, rows, caption}, list: [text],
 * commands: [{what, command}]}]}.
 */
export function show(host, model) {
  host.append(
    head({
      badge: model.badge ? badge(model.badge.word, model.badge.tone) : null,
      title: model.title,
      reason: model.reason,
      note: model.note,
      facts: model.facts,
    }),
  );
  if (model.missing?.length)
    host.append(
      h(
        'ul',
        {class: 'missing'},
        model.missing.map(text => h('li', {}, text)),
      ),
    );
  const grid = h('div', {class: 'cards'});
  host.append(grid);
  const plots = [];
  for (const part of model.sections) {
    const box = section(part.title, {note: part.note, wide: part.wide});
    grid.append(box);
    if (part.table) box.append(plainTable(part.table));
    if (part.list)
      box.append(
        h(
          'ul',
          {},
          part.list.map(text => h('li', {}, text)),
        ),
      );
    if (part.panels) {
      const place = h('div', {class: part.columns === 2 ? 'plots two' : 'plots'});
      box.append(place);
      const sync = part.stacked ? new Sync() : null;
      for (const panel of part.panels) {
        const cell = h('div', {style: {minHeight: `${(part.height || 250) + 30}px`}});
        place.append(cell);
        whenVisible(cell, () =>
          plots.push(
            new Plot(cell, panel, {
              height: part.height || 250,
              points: true,
              ...(sync ? {sync} : {}),
            }),
          ),
        );
      }
    }
    for (const c of part.commands || []) box.append(command(c.command, c.what));
  }
  return {model, plots};
}
