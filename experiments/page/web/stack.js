// Panels above one another over the same x: the names of their blocks in a bar above, one cursor. They may grow.

import {h} from 'page/dom.js';
import {Plot} from 'page/plot.js';

const kHeight = {bar: 24, plot: 112, axis: 30}; // in pixels

/** The bar: its blocks' colours are light enough for dark letters. */
const barOf = ({x, blocks}) => ({
  has_axes: false,
  x: {low: x.low, high: x.high},
  y: {low: 0, high: 1},
  series: [],
  blocks: blocks.map(block => ({
    ...block,
    opacity: 1,
    color: block.color.map(c => Math.round(c + (255 - c) * 0.35)),
  })),
});

const plain = panel => ({...panel, blocks: panel.blocks.map(block => ({...block, name: ''}))});

export class Stack {
  /** sync: a Sync of them all. */
  constructor(host, panels, sync) {
    const grid = h('div', {class: 'traces'});
    const label = title =>
      sync.onSeek ? `${title} over time; arrow keys move the time` : undefined;
    this.bar = new Plot(grid, barOf(panels[0]), {
      sync,
      height: kHeight.bar,
      label: label('stages'),
    });
    this.plots = panels.map(
      panel =>
        new Plot(grid, plain(panel), {
          sync,
          height: kHeight.plot + (panel.x.label ? kHeight.axis : 0),
          label: label(panel.title),
        }),
    );
    const hint = 'Point to see values, drag to zoom, double click (or 0) for all.';
    host.append(grid, h('p', {class: 'note hint'}, hint));
    this.set(panels);
  }

  /** More points of each curve; axes, blocks and rules as they are then. */
  grow(panels) {
    this.set(
      panels.map((panel, i) => ({
        ...panel,
        series: panel.series.map((more, k) => longer(this.panels[i].series[k], more)),
      })),
    );
  }

  /** Others of the same kind. */
  set(panels) {
    this.panels = panels;
    this.bar.set(barOf(panels[0]));
    this.bar.element.hidden = !panels[0].blocks.some(({name}) => name);
    panels.forEach((panel, i) => this.plots[i].set(plain(panel)));
  }
}

/** A series with what comes after it. */
function longer(series, more) {
  for (const column of ['x', 'y', 'low', 'high'])
    if (series[column]) for (const value of more[column]) series[column].push(value);
  return series;
}
