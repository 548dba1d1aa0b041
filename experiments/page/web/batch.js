// Many trials: what decides success, how long and how exact, why not, and each of them.

import {h, button, choice, fill, section} from 'page/dom.js';
import {load, has} from 'page/data.js';
import {clockText, fixed, number, percent, quantity, rate, words} from 'page/format.js';
import {stratified, quantile, bins, groupsOf} from 'page/numbers.js';
import {badge, command, facts, head} from 'page/parts.js';
import {Plot} from 'page/plot.js';
import {Series} from 'page/series.js';
import {drawSearch} from 'page/search.js';
import {Table} from 'page/table.js';
import {TrialView} from 'page/trial.js';
import {curve, ink, isDark, kTones, onTheme} from 'page/theme.js';

/** A packed column as a function of the row. */
function unpacked(column) {
  if (Array.isArray(column)) return i => column[i];
  return i => (column.of[i] === null ? null : column.words[column.of[i]]);
}

export function show(host, model) {
  return new BatchView(host, model);
}

export class BatchView {
  constructor(host, model) {
    this.model = model;
    this.n = model.rows;
    this.get = {};
    for (const [key, column] of Object.entries(model.columns)) this.get[key] = unpacked(column);
    for (const [key, column] of Object.entries(model.parameters)) this.get[key] = unpacked(column);
    this.success = i => this.get.failure(i) === 'none';
    this.drawHead(host);
    if (!this.n) return;
    this.plots = h('div', {class: 'plots'});
    host.append(this.plots);
    if (model.search) drawSearch(this.plots, model.search, this.n, this.get);
    else this.drawSuccess();
    this.drawFailures();
    this.drawTimes();
    this.drawErrors();
    this.drawTable(host);
    this.detail = h('div', {class: 'column', id: 'trial'});
    host.append(this.detail);
    const about = [
      ['plan', model.plan_hash],
      ['program', model.build],
      ['shard', model.shard],
      ['file', model.file],
    ];
    host.append(
      h(
        'div',
        {class: 'cards'},
        section('About', {}, facts(about)),
        model.store_kind === 'batch'
          ? section(
              'Go on from here',
              {},
              command(`turbidock status ${model.file}`, 'How far it is and what came out so far'),
              command(
                `turbidock export ${model.file} --format csv > trials.csv`,
                'Every figure of every trial',
              ),
              command(
                `turbidock verify ${model.file} --sample 10`,
                'Run some again and compare their digests',
              ),
            )
          : null,
      ),
    );
  }

  drawHead(host) {
    const {model, n} = this;
    const all = Array.from({length: n}, (_, i) => i);
    const won = all.filter(this.success);
    const expected = model.wanted ?? n;
    const complete = n >= expected && n > 0;
    const [low, high] = this.span(all, [{}]); // of all cells, whose rates differ
    const median = (key, unit = 1) =>
      this.get[key]
        ? quantile(
            won.map(i => Math.abs(this.get[key](i) ?? NaN)),
            0.5,
          ) * unit
        : NaN;
    const state =
      n === 0
        ? ['empty', 'none']
        : model.search
          ? [model.running ? 'running' : 'not running', 'none']
          : complete
            ? ['complete', 'good']
            : [model.running ? 'running' : 'partial', 'none'];
    host.append(
      head({
        badge: badge(...state),
        title: model.title,
        note: n < expected ? `${n} of about ${expected} trials` : '',
        facts: n
          ? [
              ['trials', String(n)],
              ['docked', rate(won.length / n, low, high), '95 % Wilson interval'],
              ['time to dock, median', clockText(median('time_s'))],
              [
                'true error when docked, median',
                `y ${fixed(median('final_error_true_y_m', 1000), 1)}, ` +
                  `z ${fixed(median('final_error_true_z_m', 1000), 1)} mm`,
              ],
              ['most frequent failure', this.worst(all)],
            ]
          : null,
      }),
    );
    if (model.missing.length)
      host.append(
        h(
          'ul',
          {class: 'missing'},
          model.missing.map(text => h('li', {}, text)),
        ),
      );
  }
  /** Whether an axis tells cells or strata apart, not what their trials drew or how they went. */
  isPlanned(axis) {
    return ['stratum', ...(this.model.grid || [])].includes(axis.key);
  }
  /** 95 % interval of the share that docked; of whole cells, over the plan's strata if it has any. */
  span(rows, axes) {
    const whole = this.get.stratum && axes.every(axis => this.isPlanned(axis));
    const strata = groupsOf(rows, whole ? this.get.stratum : () => '');
    return stratified(
      [...strata.values()].map(members => ({
        successes: members.filter(this.success).length,
        trials: members.length,
      })),
    );
  }
  worst(rows) {
    const counts = groupsOf(
      rows.filter(i => !this.success(i)),
      this.get.failure,
    );
    const most = [...counts].sort((a, b) => b[1].length - a[1].length)[0];
    return most ? `${words(most[0])} (${most[1].length})` : 'none';
  }

  // ------------------------------------------------------------------------- success over parameters

  /** What success may be drawn over: {key, label, numeric}. */
  axes() {
    const keys = Object.keys(this.model.parameters).map(key => ({key, label: key}));
    const starts = ['start_x_m', 'start_y_m', 'start_z_m', 'start_yaw_rad']
      .filter(key => this.get[key])
      .map(key => ({
        key,
        label: `${words(key.replace(/_(m|rad)$/, ''))}, ${quantity(key).unit}`,
        factor: quantity(key).factor,
      }));
    const list = [...keys, ...starts];
    for (const axis of list) {
      axis.values = new Map();
      axis.numeric = true;
      for (let i = 0; i < this.n; ++i) {
        const value = this.get[axis.key](i);
        if (typeof value !== 'number') axis.numeric = false;
        axis.values.set(value, (axis.values.get(value) || 0) + 1);
      }
      axis.discrete = !axis.numeric || axis.values.size <= 40;
      axis.varies = axis.values.size > 1;
    }
    return list.filter(axis => axis.varies);
  }

  drawSuccess() {
    this.allAxes = this.axes();
    const numeric = this.allAxes.filter(a => a.numeric && !a.key.startsWith('start_'));
    const first = numeric[0] || this.allAxes[0];
    const box = section('Success', {wide: true});
    this.plots.append(box);
    if (!first) {
      box.append(h('p', {class: 'note'}, 'Nothing varies between these trials but the seed.'));
      return;
    }
    const second =
      this.allAxes.find(
        a => a !== first && a.discrete && a.values.size <= 8 && a.key !== 'stratum',
      ) || (first.key.startsWith('start_') ? this.allAxes.find(a => a !== first) : null);
    this.over = first.key;
    this.by = second ? second.key : '';
    const options = this.allAxes.map(a => [a.key, a.label]);
    const redraw = () => this.fillSuccess();
    const bySelect = choice('by', [['', 'nothing else'], ...options], this.by, value => {
      this.by = value;
      redraw();
    });
    box.append(
      h(
        'div',
        {class: 'controls'},
        choice('over', options, this.over, value => {
          this.over = value;
          redraw();
        }),
        bySelect,
        h(
          'span',
          {class: 'note'},
          `Bars are 95 % Wilson intervals${this.get.stratum ? ', of whole cells over the strata' : ''}. ` +
            'Click a point to list its trials.',
        ),
      ),
    );
    this.successHost = h('div', {});
    box.append(this.successHost);
    this.fillSuccess();
    onTheme(() => this.fillSuccess());
  }

  /** Values of an axis as groups in order: [{label, at, rows, low, high}]. */
  grouped(axis, rows, most = 12) {
    const f = axis.factor || 1;
    const get = this.get[axis.key];
    if (axis.discrete) {
      const groups = [...groupsOf(rows, get)];
      groups.sort(([a], [b]) =>
        typeof a === 'number' && typeof b === 'number'
          ? a - b
          : String(a).localeCompare(String(b), 'en', {numeric: true}),
      );
      return groups.map(([value, members], k) => ({
        label: typeof value === 'number' ? number(value * f) : String(value),
        at: axis.numeric ? value * f : k,
        rows: members,
      }));
    }
    const values = rows
      .map(get)
      .filter(Number.isFinite)
      .sort((a, b) => a - b);
    const count = Math.min(most, Math.max(2, Math.floor(Math.sqrt(values.length / 3))));
    const edges = Array.from(
      {length: count + 1},
      (_, k) => values[0] + ((values[values.length - 1] - values[0]) * k) / count,
    );
    return edges.slice(0, -1).map((low, k) => {
      const high = edges[k + 1];
      const members = rows.filter(
        i => get(i) >= low && (get(i) < high || (k === count - 1 && get(i) <= high)),
      );
      return {
        label: `${number(low * f, 3)} to ${number(high * f, 3)}`,
        at: ((low + high) / 2) * f,
        low: low * f,
        high: high * f,
        rows: members,
      };
    });
  }

  fillSuccess() {
    const over = this.allAxes.find(a => a.key === this.over);
    const by = this.allAxes.find(a => a.key === this.by && a !== over);
    const rows = Array.from({length: this.n}, (_, i) => i);
    fill(this.successHost);
    const asMap = by && (by.values.size > 8 || !by.discrete);
    asMap ? this.successMap(over, by, rows) : this.successCurves(over, by, rows);
  }

  successCurves(over, by, rows) {
    const axes = by ? [over, by] : [over];
    const lines = by ? this.grouped(by, rows) : [{label: 'docked', rows}];
    const names = over.numeric ? [] : this.grouped(over, rows).map(g => g.label);
    const all = over.numeric ? this.grouped(over, rows).map(g => g.at) : [];
    // Side by side, or bars would hide each other.
    const width = over.numeric ? Math.max(...all) - Math.min(...all) : 0;
    const series = lines.map((line, k) => {
      const groups = this.grouped(over, line.rows).filter(g => g.rows.length);
      const rates = groups.map(g => g.rows.filter(this.success).length / g.rows.length);
      const spans = groups.map(g => this.span(g.rows, axes));
      const shift =
        over.numeric && groups.length > 1
          ? (lines.length > 1 ? 0.006 : 0) * width * (k - (lines.length - 1) / 2)
          : 0;
      const at = over.numeric
        ? groups.map(g => g.at + shift)
        : groups.map(g => names.indexOf(g.label) + (k - (lines.length - 1) / 2) * 0.1);
      return {
        name: by ? line.label : 'docked',
        x: at,
        y: rates.map(r => 100 * r),
        low: spans.map(s => 100 * s[0]),
        high: spans.map(s => 100 * s[1]),
        color: curve(k),
        mark: over.numeric ? 'line_with_bars' : 'bars',
        dot: 7,
        groups,
      };
    });
    new Plot(
      this.successHost,
      {
        title: '',
        x: {label: over.label, names},
        y: {label: 'docked, %', low: -3, high: 103},
        series,
        rules: [{at: 50, color: [140, 148, 156], mark: 'dashes'}],
        legend: 'none',
      },
      {
        height: 260,
        points: true,
        label:
          `share docked over ${over.label}${by ? ` by ${by.label}` : ''}; ` +
          'arrow keys go from point to point, Enter lists its trials',
        readout: (s, i) => {
          const g = s.groups[i];
          const won = g.rows.filter(this.success).length;
          const all = g.rows.length;
          return (
            `${by ? `${by.label} ${s.name}\n` : ''}${over.label} ${g.label}\n` +
            `${won} of ${all} docked: ${rate(won / all, ...this.span(g.rows, axes))}`
          );
        },
        onPick: (s, i) =>
          this.list(
            s.groups[i].rows,
            `${over.label} ${s.groups[i].label}${by ? `, ${by.label} ${s.name}` : ''}`,
          ),
      },
    );
  }

  successMap(over, by, rows) {
    const across = this.grouped(over, rows);
    const up = this.grouped(by, rows);
    const blocks = [];
    const points = {x: [], y: [], cells: []};
    const edges = (groups, k) =>
      Number.isFinite(groups[k].low) ? [groups[k].low, groups[k].high] : [k - 0.5, k + 0.5];
    for (let a = 0; a < across.length; ++a)
      for (let b = 0; b < up.length; ++b) {
        const there = new Set(across[a].rows);
        const members = up[b].rows.filter(i => there.has(i));
        if (!members.length) continue;
        const won = members.filter(this.success).length;
        const share = won / members.length;
        const [x0, x1] = edges(across, a);
        const [y0, y1] = edges(up, b);
        const color = mapColor(share);
        blocks.push({
          name: `${fixed(100 * share, 0)}`,
          x0,
          x1,
          y0,
          y1,
          fill: color.fill,
          ink: color.ink,
        });
        points.x.push((x0 + x1) / 2);
        points.y.push((y0 + y1) / 2);
        points.cells.push({
          members,
          won,
          label: `${over.label} ${across[a].label}\n${by.label} ${up[b].label}`,
        });
      }
    const axis = (groups, spec) =>
      Number.isFinite(groups[0].low)
        ? {label: spec.label, low: groups[0].low, high: groups[groups.length - 1].high}
        : {
            label: spec.label,
            names: groups.map(g => g.label),
            low: -0.5,
            high: groups.length - 0.5,
          };
    new Plot(
      this.successHost,
      {
        title: 'docked, % of the trials in each cell',
        x: axis(across, over),
        y: axis(up, by),
        blocks,
        legend: 'none',
        series: [{name: '', ...points, color: [0, 60, 90], mark: 'dots', dot: 0.1}],
      },
      {
        height: Math.max(280, Math.min(440, up.length * 34 + 60)),
        points: true,
        label:
          `share docked over ${over.label} and ${by.label}; ` +
          'arrow keys go from cell to cell, Enter lists its trials',
        readout: (s, i) => {
          const c = points.cells[i];
          const all = c.members.length;
          return `${c.label}\n${c.won} of ${all} docked: ${rate(c.won / all, ...this.span(c.members, [over, by]))}`;
        },
        onPick: (s, i) =>
          this.list(points.cells[i].members, points.cells[i].label.replace('\n', ', ')),
      },
    );
  }

  // ------------------------------------------------------------------------- what the table has in it

  drawFailures() {
    const box = section('Why not', {note: 'Click a reason to list its trials.'});
    this.failureHost = h('div', {class: 'bar-list'});
    box.append(this.failureHost);
    this.plots.append(box);
  }
  fillFailures(found) {
    const counts = [...groupsOf(found, this.get.failure)].sort(
      (a, b) => (a[0] === 'none') - (b[0] === 'none') || b[1].length - a[1].length,
    );
    const most = Math.max(...counts.map(([, rows]) => rows.length), 1);
    fill(
      this.failureHost,
      counts.map(([failure, rows]) => [
        button(failure === 'none' ? 'docked' : words(failure), () => this.pickFailure(failure), {
          class: 'link',
          title: `list ${rows.length} trials: ${words(failure)}`,
        }),
        h(
          'div',
          {class: 'bar', 'aria-hidden': 'true'},
          h('span', {
            style: {
              width: `${(100 * rows.length) / most}%`,
              background: ink(failure === 'none' ? kTones.good : kTones.bad),
            },
          }),
        ),
        h('span', {}, `${rows.length} (${percent(rows.length / found.length, 1)})`),
      ]),
    );
  }
  pickFailure(failure) {
    this.table.filter('failure', failure);
    this.toTable();
  }

  drawTimes() {
    const box = section('Time to dock', {note: 'Of the trials that docked.'});
    this.plots.append(box);
    this.times = new Plot(
      box,
      {series: [], legend: 'none'},
      {
        height: 210,
        points: true,
        label: 'distribution of the time to dock',
        readout: (s, i) => `${number(s.low[i], 3)} to ${number(s.high[i], 3)} s\n${s.y[i]} trials`,
        onPick: (s, i) =>
          this.list(s.members[i], `docked in ${number(s.low[i], 3)} to ${number(s.high[i], 3)} s`),
      },
    );
  }
  drawErrors() {
    if (!this.get.final_error_true_y_m || !this.get.final_error_true_z_m) return;
    const box = section('True error when it ended', {
      note: 'The square is what docking allows; those farther off stand at the edge. Click one to see it.',
    });
    this.plots.append(box);
    this.errors = new Plot(
      box,
      {series: [], legend: 'none'},
      {
        height: 210,
        points: true,
        label: 'true y and z error at the end of each trial',
        readout: (s, i) =>
          `trial ${this.get.trial(s.rows[i])}: ${words(this.get.outcome(s.rows[i]))}\n` +
          `y ${fixed(1000 * this.get.final_error_true_y_m(s.rows[i]), 1)} mm, ` +
          `z ${fixed(1000 * this.get.final_error_true_z_m(s.rows[i]), 1)} mm`,
        onPick: (s, i) => this.pick(s.rows[i]),
      },
    );
  }
  fillDistributions(found) {
    const won = found.filter(this.success);
    this.fillFailures(found);
    const groups = bins(
      won.filter(i => Number.isFinite(this.get.time_s?.(i))),
      this.get.time_s,
      28,
    );
    this.times.set({
      x: {label: 'time to dock, s'},
      y: {label: 'trials', low: 0},
      legend: 'none',
      rules: [],
      series: [
        {
          name: '',
          mark: 'columns',
          color: curve(0),
          x: groups.map(g => (g.low + g.high) / 2),
          y: groups.map(g => g.rows.length),
          low: groups.map(g => g.low),
          high: groups.map(g => g.high),
          members: groups.map(g => g.rows),
        },
      ],
    });
    if (!this.errors) return;
    const y = i => 1000 * this.get.final_error_true_y_m(i);
    const z = i => 1000 * this.get.final_error_true_z_m(i);
    const one = (name, rows, color, mark) => ({
      name,
      rows,
      color,
      mark,
      dot: found.length > 2000 ? 2 : 4,
      x: rows.map(i => within(y(i))),
      y: rows.map(i => within(z(i))),
    });
    const within = value => Math.min(Math.max(value, -0.98 * reach), 0.98 * reach);
    const there = found.filter(
      i =>
        Number.isFinite(this.get.final_error_true_y_m(i)) &&
        Number.isFinite(this.get.final_error_true_z_m(i)),
    );
    const limits = Object.values(this.model.models)[0]?.limits || {
      tolerance_y_m: 0.04,
      tolerance_z_m: 0.04,
    };
    const inside = there.filter(this.success);
    const far = get =>
      quantile(
        inside.map(i => Math.abs(get(i))),
        0.98,
      ) || 0;
    const reach = Math.max(
      1600 * limits.tolerance_y_m,
      1600 * limits.tolerance_z_m,
      1.2 * far(y),
      1.2 * far(z),
    );
    this.errors.set({
      x: {label: 'y, mm', low: -reach, high: reach},
      y: {label: 'z, mm', low: -reach, high: reach},
      legend: 'none',
      rules: [],
      blocks: [
        {
          x0: -1000 * limits.tolerance_y_m,
          x1: 1000 * limits.tolerance_y_m,
          y0: -1000 * limits.tolerance_z_m,
          y1: 1000 * limits.tolerance_z_m,
          color: [46, 139, 87],
          opacity: 0.16,
        },
      ],
      series: [
        one(
          'not docked',
          there.filter(i => !this.success(i)),
          [213, 94, 0],
          'rings',
        ),
        one('docked', there.filter(this.success), [0, 114, 178], 'dots'),
      ],
    });
  }

  // ------------------------------------------------------------------------- the table and its trials

  drawTable(host) {
    const {model, get} = this;
    const numeric = (key, label, more = {}) => {
      const {unit, factor} = quantity(key);
      return {
        key,
        label: label ?? `${quantity(key).label}${unit ? `, ${unit}` : ''}`,
        numeric: true,
        title: key,
        value: get[key],
        filterValue: i => {
          const v = get[key](i);
          return v === null ? null : v * factor;
        },
        text: i => {
          const v = get[key](i);
          return v === null || v === undefined ? '–' : number(v * factor);
        },
        ...more,
      };
    };
    const word = (key, label, choices) => ({
      key,
      label,
      value: i => get[key](i),
      text: i => words(get[key](i) ?? '–'),
      choices: choices
        ? [...new Set(Array.from({length: this.n}, (_, i) => get[key](i)))]
            .filter(v => v !== null)
            .sort()
        : null,
    });
    const used = new Set([
      'trial',
      'outcome',
      'failure',
      'time_s',
      'reason',
      'cell',
      'sample',
      'seed',
    ]);
    const isNumber = key => {
      for (let i = 0; i < this.n; ++i) {
        const v = get[key](i);
        if (v !== null) return typeof v === 'number';
      }
      return false;
    };
    const columns = [
      numeric('trial', 'trial', {
        width: `${Math.max(74, 9 * String(get.trial(this.n - 1)).length + 20)}px`,
        text: i => String(get.trial(i)),
      }),
      word('outcome', 'outcome', true),
      word('failure', 'failure', true),
    ];
    for (const key of Object.keys(model.parameters))
      columns.push(
        isNumber(key)
          ? numeric(key, key, {
              width: `${Math.min(290, Math.max(130, 8 * key.length + 20))}px`,
              filterValue: i => get[key](i),
              text: i => number(get[key](i)),
            })
          : {
              ...word(
                key,
                key,
                new Set(Array.from({length: this.n}, (_, i) => get[key](i))).size < 30,
              ),
              text: i => String(get[key](i) ?? '–'),
            },
      );
    columns.push(numeric('time_s', 'time, s'), {
      key: 'reason',
      label: 'reason',
      value: i => get.reason?.(i),
      width: '280px',
    });
    for (const key of Object.keys(model.columns))
      if (!used.has(key) && isNumber(key)) columns.push(numeric(key, undefined, {width: '128px'}));
    columns.push({key: 'seed', label: 'seed', value: i => get.seed(i), width: '190px'});
    const box = section('Trials', {wide: true, id: 'trials'});
    host.append(box);
    this.table = new Table(box, columns, this.n, {
      label: 'trials',
      height: 380,
      onPick: i => this.pick(i),
      action: 'Click a trial to see it',
      onFound: found => this.fillDistributions(found),
    });
    this.tableBox = box;
  }
  toTable() {
    this.tableBox.scrollIntoView({block: 'start'});
    this.table.scroll.focus({preventScroll: true});
  }

  /** Lists these trials in the table. */
  list(rows, why) {
    this.table.restrict(new Set(rows), why);
    this.toTable();
  }

  rowOf(trial) {
    for (let i = 0; i < this.n; ++i) if (this.get.trial(i) === trial) return i;
    return -1;
  }

  /** Shows a trial below the table. */
  async pick(row) {
    const {model, get} = this;
    const trial = get.trial(row);
    this.table.picked = row;
    this.table.draw();
    const scenario = get.scenario ? get.scenario(row) : '';
    const base = model.models[scenario] || model.models[''];
    const parameters = Object.keys(model.parameters).map(key => [key, String(get[key](row))]);
    const box = section(
      `Trial ${trial}`,
      {wide: true},
      h(
        'div',
        {class: 'head-title'},
        badge(get.outcome(row)),
        h('span', {class: 'reason'}, get.reason?.(row) || ''),
      ),
      facts([
        ['failure', words(get.failure(row))],
        ['time', clockText(get.time_s?.(row))],
        ['seed', get.seed(row)],
        ...parameters,
      ]),
      model.store_kind === 'batch'
        ? command(
            `turbidock replay ${model.file} ${trial} --out out/${trial}`,
            'The trial again, with film and all its files',
          )
        : null,
    );
    fill(this.detail, box);
    box.tabIndex = -1;
    const part = `series-${trial}`;
    if (has(part) && base) {
      const columns = await load(part);
      this.view = new TrialView(
        this.detail,
        {...base, record: null},
        {series: new Series(columns), withHead: false},
      );
      this.view.clock.seek(Math.max(0, this.view.series.end - 0.5));
    } else {
      box.append(
        h(
          'p',
          {class: 'note'},
          model.series_stored
            ? `Its traces are not in this page, which has those of ${model.series_trials.length} of ` +
                `${model.series_stored} trials, failures first: ` +
                `turbidock report ${model.file} --trial ${trial} shows them.`
            : 'The batch stored no traces (series_every_frames in its plan): the command above makes them.',
        ),
      );
    }
    box.scrollIntoView({block: 'start'});
    box.focus({preventScroll: true});
  }
}

/** From orange (none docked) through white to blue (all): told apart in grey by the numbers. */
function mapColor(share) {
  const from = isDark() ? [122, 52, 12] : [247, 176, 120];
  const middle = isDark() ? [52, 62, 70] : [243, 244, 245];
  const to = isDark() ? [18, 84, 140] : [120, 184, 228];
  const [a, b, t] = share < 0.5 ? [from, middle, share * 2] : [middle, to, share * 2 - 1];
  return {
    fill: `rgb(${a.map((c, k) => Math.round(c + (b[k] - c) * t)).join(' ')})`,
    ink: isDark() ? '#f2f6f9' : '#16202a',
  };
}
