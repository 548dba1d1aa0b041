// Success of a batch's trials over anything that they differ in, by anything else.

import {h, choice, fill, section} from 'page/dom.js';
import {number, rate, titled} from 'page/format.js';
import {bins, groupsOf} from 'page/numbers.js';
import {Plot} from 'page/plot.js';
import {curve} from 'page/theme.js';

// Numbers of more values than this are put into so many bins: across, and as curves.
const kAcross = {values: 40, bins: 12};
const kCurves = {values: 8, bins: 5};
const kStarts = ['start_x_m', 'start_y_m', 'start_z_m', 'start_yaw_rad'];

/** What trials can be told apart by: {key, label, factor to what is shown, isNumeric, count of values}. */
function axesOf(trials) {
  const starts = kStarts.filter(key => trials.get[key]);
  return [...trials.parameters, ...starts]
    .map(key => {
      const named = trials.names[key];
      const count = trials.distinct(key).size;
      const isNumeric = trials.isNumeric(key);
      return {key, label: titled(named), factor: named.factor, isNumeric, count};
    })
    .filter(axis => axis.count > 1);
}

export class Success {
  /** trials: Trials; onPick(rows, why) when somebody clicks a point. */
  constructor(host, trials, onPick) {
    Object.assign(this, {trials, onPick});
    this.axes = axesOf(trials);
    const box = section('Success', {wide: true});
    host.append(box);
    const isStart = axis => kStarts.includes(axis.key);
    const first = this.axes.find(axis => axis.isNumeric && !isStart(axis)) || this.axes[0];
    if (!first) {
      box.append(h('p', {class: 'note'}, 'Nothing varies between these trials but the seed.'));
      return;
    }
    // of the plan's own, not of what was drawn at random
    const isCurve = axis =>
      axis !== first && axis.key !== 'stratum' && trials.planned.has(axis.key);
    const second = this.axes.find(axis => isCurve(axis) && axis.count <= kCurves.values);
    this.over = first.key;
    this.by = second?.key || '';
    const options = this.axes.map(({key, label}) => [key, label]);
    const set = name => key => {
      this[name] = key;
      this.draw();
    };
    const how = trials.get.stratum ? ', of whole cells over the strata' : '';
    const note = `Bars are 95 % Wilson intervals${how}; lines join what was run. Click a point to list its trials.`;
    this.ground = h('div');
    box.append(
      h(
        'div',
        {class: 'line'},
        choice('over', options, this.over, set('over')),
        choice('by', [['', 'nothing else'], ...options], this.by, set('by')),
        h('span', {class: 'note'}, note),
      ),
      this.ground,
    );
    this.draw();
  }

  /** An axis's values, or bins of them: [{label, at, rows}]. */
  groups({key, factor, isNumeric, count}, most) {
    const {trials} = this;
    const get = trials.get[key];
    if (isNumeric && count > most.values) {
      const there = trials.rows.filter(row => Number.isFinite(get(row)));
      return bins(there, row => get(row) * factor, most.bins).map(({low, high, rows}) => ({
        label: `${number(low, 3)} to ${number(high, 3)}`,
        at: (low + high) / 2,
        rows,
      }));
    }
    const rows = groupsOf(trials.rows, get);
    return trials.values(key).map((value, k) => ({
      label: isNumeric ? number(value * factor) : String(value),
      at: isNumeric ? value * factor : k,
      rows: rows.get(value),
    }));
  }

  draw() {
    const over = this.axes.find(axis => axis.key === this.over);
    const by = this.axes.find(axis => axis.key === this.by && axis !== over);
    const across = this.groups(over, kAcross);
    const lines = by ? this.groups(by, kCurves) : [{label: 'success', rows: this.trials.rows}];
    const placeOf = new Map(across.flatMap(({rows}, k) => rows.map(row => [row, k])));
    const keys = [over, by].filter(Boolean).map(axis => axis.key);
    // of each line, a cell for each value across that has trials in it
    const cells = lines.map(line =>
      [...groupsOf(line.rows, row => placeOf.get(row))]
        .filter(([k]) => k !== undefined)
        .sort(([a], [b]) => a - b)
        .map(([k, rows]) => ({
          k,
          rows,
          rate: this.trials.rate(rows, keys),
          label: `${over.label} ${across[k].label}${by ? `, ${by.label} ${line.label}` : ''}`,
        })),
    );
    const what = `success over ${over.label}${by ? ` by ${by.label}` : ''}`;
    fill(this.ground);
    new Plot(this.ground, curvesOf(cells, over, across, lines), {
      height: 260,
      label: `${what}; arrow keys go from point to point, Enter lists its trials`,
      readout: ({cells: own}, i) => {
        const {won, all, share, low, high} = own[i].rate;
        return `${own[i].label}\n${won} of ${all} succeed: ${rate(share, low, high)}`;
      },
      onPick: ({cells: own}, i) => this.onPick(own[i].rows, own[i].label),
    });
  }
}

function curvesOf(cells, over, across, lines) {
  const width = across[across.length - 1].at - across[0].at;
  // side by side, or bars would hide each other
  const step = over.isNumeric ? 0.006 * width : 0.1;
  return {
    x: {label: over.label, names: over.isNumeric ? [] : across.map(({label}) => label)},
    y: {label: 'success, %', low: -3, high: 103},
    rules: [{at: 50, color: [140, 148, 156], mark: 'dashes'}],
    series: lines.map(({label}, line) => ({
      name: label,
      color: curve(line),
      mark: over.isNumeric ? 'line_with_bars' : 'bars',
      dot: 7,
      cells: cells[line],
      x: cells[line].map(({k}) => across[k].at + step * (line - (lines.length - 1) / 2)),
      y: cells[line].map(cell => 100 * cell.rate.share),
      low: cells[line].map(cell => 100 * cell.rate.low),
      high: cells[line].map(cell => 100 * cell.rate.high),
    })),
  };
}
