// Success of a batch's trials over anything that they differ in, by anything else: the program's charts
// (experiments/batch/success_charts.h), of which one is chosen.

import {h, choice, fill} from 'page/dom.js';
import {rate} from 'page/format.js';
import {Plot} from 'page/plot.js';

const kNote =
  'Bars are 95 % Wilson intervals, of whole cells over the strata, if any. Click a point to list its trials.';

export class Success {
  /** trials: Trials; charts: {axes, over, by, panels}; onPick(rows, why) when somebody clicks a point. */
  constructor(box, trials, charts, onPick) {
    Object.assign(this, {trials, charts, onPick, over: charts.over, by: charts.by});
    box.classList.add('wide');
    if (!charts.over) {
      box.append(h('p', {class: 'note'}, 'Nothing varies between these trials but the seed.'));
      return;
    }
    const options = charts.axes.map(({key, label}) => [key, label]);
    const set = name => key => {
      this[name] = key;
      this.draw();
    };
    this.ground = h('div');
    box.append(
      h(
        'div',
        {class: 'line'},
        choice('over', options, this.over, set('over')),
        choice('by', [['', 'nothing else'], ...options], this.by, set('by')),
        h('span', {class: 'note'}, kNote),
      ),
      this.ground,
    );
    this.draw();
  }

  draw() {
    const by = this.by === this.over ? '' : this.by;
    const panel = this.charts.panels[`${this.over}|${by}`];
    const axis = key => this.charts.axes.find(one => one.key === key);
    const [over, curves] = [axis(this.over), axis(by)];
    /** A point's trials, and what they share. */
    const cell = link => {
      const [k, line] = link.split(',').map(Number);
      const {trials} = this;
      return {
        rows: trials.rows.filter(
          row => over.across.of[row] === k && (!curves || curves.lines.of[row] === line),
        ),
        label:
          `${over.label} ${over.across.names[k]}` +
          (curves ? `, ${curves.label} ${curves.lines.names[line]}` : ''),
      };
    };
    fill(this.ground);
    new Plot(this.ground, panel, {
      height: 260,
      label: `${panel.title}; arrow keys go from point to point, Enter lists its trials`,
      readout: ({links, y, low, high}, i) => {
        const {rows, label} = cell(links[i]);
        const won = rows.filter(this.trials.isSuccess).length;
        const share = rate(y[i] / 100, low[i] / 100, high[i] / 100);
        return `${label}\n${won} of ${rows.length} succeed: ${share}`;
      },
      onPick: ({links}, i) => {
        const {rows, label} = cell(links[i]);
        this.onPick(rows, label);
      },
    });
  }
}
