// Success of a batch's trials over anything that they differ in, by anything else: curves, or a map where those would
// be too many.

import {h, choice, fill, section} from 'page/dom.js';
import {fixed, number, quantity, rate, words} from 'page/format.js';
import {bins, groupsOf} from 'page/numbers.js';
import {Plot} from 'page/plot.js';
import {curve} from 'page/theme.js';

const kMostValues = 40; // of an axis that is not put into bins
const kMostBins = 12;
const kMostCurves = 8;
const kStarts = ['start_x_m', 'start_y_m', 'start_z_m', 'start_yaw_rad'];

/** What trials can be told apart by: {key, label, factor to what is shown, isNumeric, isDiscrete, values}. */
function axesOf(trials) {
  const starts = kStarts.filter(key => trials.get[key]);
  return [...trials.parameters, ...starts]
    .map(key => {
      const {label, unit, factor} = quantity(key);
      const count = trials.distinct(key).size;
      const isNumeric = trials.isNumeric(key);
      const isDiscrete = !isNumeric || count <= kMostValues;
      const values = isDiscrete ? trials.values(key) : [];
      const shown = starts.includes(key)
        ? {label: `${label}, ${unit}`, factor}
        : {label: key, factor: 1};
      return {key, ...shown, isNumeric, isDiscrete, count, values};
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
    const isFew = ({isDiscrete, values, key}) =>
      isDiscrete && values.length <= kMostCurves && key !== 'stratum';
    const others = this.axes.filter(axis => axis !== first);
    const second = others.find(isFew) || (isStart(first) ? others[0] : null);
    this.over = first.key;
    this.by = second?.key || '';
    const options = this.axes.map(({key, label}) => [key, label]);
    const set = name => key => {
      this[name] = key;
      this.draw();
    };
    const how = trials.get.stratum ? ', of whole cells over the strata' : '';
    const note = `Bars are 95 % Wilson intervals${how}. Click a point to list its trials.`;
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

  /** An axis's values, or bins of them: [{label, at, low, high, rows}]. */
  groups({key, factor, isDiscrete, isNumeric, values}) {
    const get = this.trials.get[key];
    if (isDiscrete) {
      const rows = groupsOf(this.trials.rows, get);
      return values.map((value, k) => ({
        label: isNumeric ? number(value * factor) : String(value),
        at: isNumeric ? value * factor : k,
        low: k - 0.5,
        high: k + 0.5,
        rows: rows.get(value),
      }));
    }
    const there = this.trials.rows.filter(row => Number.isFinite(get(row)));
    return bins(there, row => get(row) * factor, kMostBins).map(({low, high, rows}) => ({
      label: `${number(low, 3)} to ${number(high, 3)}`,
      at: (low + high) / 2,
      low,
      high,
      rows,
    }));
  }

  draw() {
    const over = this.axes.find(axis => axis.key === this.over);
    const by = this.axes.find(axis => axis.key === this.by && axis !== over);
    const across = this.groups(over);
    const lines = by ? this.groups(by) : [{label: 'docked', rows: this.trials.rows}];
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
    const isMap = by && (!by.isDiscrete || by.values.length > kMostCurves);
    const panel = isMap
      ? mapOf(cells, over, by, across, lines)
      : curvesOf(cells, over, across, by ? lines : [{label: 'docked'}]);
    const what = `share docked over ${over.label}${by ? ` by ${by.label}` : ''}`;
    fill(this.ground);
    new Plot(
      this.ground,
      {title: '', legend: 'none', ...panel},
      {
        height: isMap ? Math.max(280, Math.min(440, lines.length * 34 + 60)) : 260,
        label: `${what}; arrow keys go from point to point, Enter lists its trials`,
        readout: ({cells: own}, i) => {
          const {won, all, share, low, high} = own[i].rate;
          return `${own[i].label}\n${won} of ${all} docked: ${rate(share, low, high)}`;
        },
        onPick: ({cells: own}, i) => this.onPick(own[i].rows, own[i].label),
      },
    );
  }
}

function curvesOf(cells, over, across, lines) {
  const width = across[across.length - 1].at - across[0].at;
  // side by side, or bars would hide each other
  const step = over.isNumeric ? 0.006 * width : 0.1;
  return {
    x: {label: over.label, names: over.isNumeric ? [] : across.map(({label}) => label)},
    y: {label: 'docked, %', low: -3, high: 103},
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

function mapOf(cells, over, by, across, up) {
  const all = cells.flatMap((list, line) => list.map(cell => ({...cell, line})));
  const axis = ({label, isDiscrete}, groups) => ({
    label,
    low: groups[0].low,
    high: groups[groups.length - 1].high,
    ...(isDiscrete ? {names: groups.map(group => group.label)} : {}),
  });
  const middle = ({low, high}) => (low + high) / 2;
  return {
    title: 'docked, % of the trials in each cell',
    x: axis(over, across),
    y: axis(by, up),
    blocks: all.map(({k, line, rate: {share}}) => ({
      name: fixed(100 * share, 0),
      x0: across[k].low,
      x1: across[k].high,
      y0: up[line].low,
      y1: up[line].high,
      color: curve(0),
      opacity: 0.04 + 0.5 * share,
    })),
    series: [
      {
        name: '',
        color: [0, 60, 90],
        mark: 'dots',
        dot: 0.1,
        cells: all,
        x: all.map(({k}) => middle(across[k])),
        y: all.map(({line}) => middle(up[line])),
      },
    ],
  };
}
