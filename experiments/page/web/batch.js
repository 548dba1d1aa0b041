// Many trials: what decides success, how long and how exact, why not, and each of them.

import {h, button, fill} from 'page/dom.js';
import {has} from 'page/data.js';
import {
  clockText,
  fixed,
  measured,
  number,
  percent,
  shown,
  spoken,
  titled,
  words,
} from 'page/format.js';
import {bins, groupsOf} from 'page/numbers.js';
import {reveal} from 'page/parts.js';
import {Plot} from 'page/plot.js';
import {drawHead, drawSections} from 'page/report.js';
import {Success} from 'page/success.js';
import {Table} from 'page/table.js';
import {curve} from 'page/theme.js';
import {openTrials} from 'page/trial.js';
import {Trials} from 'page/trials.js';

const kMany = 2000; // points are smaller
const kShownElsewhere = ['trial', 'outcome', 'failure', 'time_s', 'reason', 'seed'];

export const show = (host, model) => new BatchView(host, model);

class BatchView {
  constructor(host, model) {
    this.model = model;
    this.trials = new Trials(model);
    this.detail = h('div', {id: 'trial'});
    drawHead(host, model);
    const players = {
      success: box =>
        new Success(box, this.trials, model.success, (rows, why) => this.list(rows, why)),
      failures: box => this.addFailures(box),
      times: box => this.addTimes(box),
      errors: box => this.addErrors(box),
      trials: box => this.addTable(box),
    };
    drawSections(host, model, players, {
      trial: number => this.table.pick(this.rowOf(Number(number))),
    });
    host.append(this.detail);
  }

  addFailures(box) {
    const note = 'Of the trials listed below. Click a reason to list its own.';
    this.failures = h('div', {class: 'bar-list'});
    box.append(h('p', {class: 'note'}, note), this.failures);
  }

  rowOf(number) {
    return Array.from({length: this.model.rows}, (_, row) => row).find(
      row => this.trials.get.trial(row) === number,
    );
  }

  addTable(box) {
    box.id = 'trials';
    box.classList.add('wide');
    this.tableBox = box;
    this.table = new Table(box, this.columns(), this.model.rows, {
      label: 'trials',
      onPick: row => this.pick(row),
      onFound: rows => this.fill(rows),
    });
  }

  /** Lists these trials in the table. */
  list(rows, why) {
    this.table.restrict(rows, why);
    reveal(this.tableBox);
  }

  addTimes(box) {
    this.noTimes = h('p', {}, 'None of these succeeded.');
    box.append(h('p', {class: 'note'}, 'Of the trials that succeeded.'), this.noTimes);
    const span = ({low, high}, i) => `${number(low[i], 3)} to ${number(high[i], 3)} s`;
    this.times = new Plot(
      box,
      {series: []},
      {
        height: 210,
        label: 'distribution of the time to dock',
        readout: (s, i) => `${span(s, i)}\n${s.y[i]} trials`,
        onPick: (s, i) => this.list(s.members[i], `success in ${span(s, i)}`),
      },
    );
  }

  addErrors(box) {
    const {get} = this.trials;
    if (!get.final_error_true_y_m || !get.final_error_true_z_m) return false;
    const note =
      'The square is what docking allows; those farther off stand at the edge. Click one to see it.';
    box.append(h('p', {class: 'note'}, note));
    const mm = (key, row) => fixed(1000 * get[`final_error_true_${key}_m`](row), 1);
    this.errors = new Plot(
      box,
      {series: []},
      {
        height: 210,
        label: 'true y and z error at the end of each trial',
        readout: ({rows}, i) =>
          `trial ${get.trial(rows[i])}: ${words(get.outcome(rows[i]))}\n` +
          `y ${mm('y', rows[i])} mm, z ${mm('z', rows[i])} mm`,
        onPick: ({rows}, i) => this.table.pick(rows[i]),
      },
    );
  }

  /** Draws what depends on which trials the table lists. */
  fill(rows) {
    this.fillFailures(rows);
    const {time_s} = this.trials.get;
    const timed = rows.filter(row => this.trials.isSuccess(row) && Number.isFinite(time_s(row)));
    this.times.set(timesOf(bins(timed, time_s, 28)));
    this.noTimes.hidden = timed.length > 0;
    this.times.element.hidden = !timed.length;
    this.errors?.set(this.errorsOf(rows));
  }

  fillFailures(found) {
    const failed = found.filter(row => !this.trials.isSuccess(row));
    const counts = [...groupsOf(failed, this.trials.get.failure)].sort(
      (a, b) => b[1].length - a[1].length,
    );
    const pick = failure => {
      this.table.filter('failure', failure);
      reveal(this.tableBox);
    };
    if (!failed.length)
      return fill(
        this.failures,
        h('p', {}, found.length ? 'All of them succeeded.' : 'None is listed.'),
      );
    const bar = share =>
      h(
        'div',
        {class: 'bar', 'aria-hidden': 'true'},
        h('span', {class: 'bad', style: {width: percent(share, 1).replace(' ', '')}}),
      );
    fill(
      this.failures,
      counts.map(([failure, rows]) => [
        button(words(failure), () => pick(failure), {
          class: 'link',
          title: `list ${rows.length} trials`,
        }),
        bar(rows.length / found.length),
        h('span', {}, `${rows.length} (${percent(rows.length / found.length, 1)})`),
        h('span', {class: 'note'}, this.model.meanings[failure]),
      ]),
    );
  }

  errorsOf(found) {
    const {get, isSuccess} = this.trials;
    const y = row => 1000 * (get.final_error_true_y_m(row) ?? NaN);
    const z = row => 1000 * (get.final_error_true_z_m(row) ?? NaN);
    // of a plan that this program does not understand nothing is known
    const {tolerance_y_m = 0, tolerance_z_m = 0} = this.model.limits || {};
    const rows = found.filter(row => Number.isFinite(y(row)) && Number.isFinite(z(row)));
    const won = rows.filter(isSuccess);
    const reach = 1600 * Math.max(tolerance_y_m, tolerance_z_m) || 100;
    const points = (name, of, more) => ({
      name,
      rows: of,
      dot: found.length > kMany ? 2 : 4,
      x: of.map(y),
      y: of.map(z),
      ...more,
    });
    const square = {
      from_x: -1000 * tolerance_y_m,
      to_x: 1000 * tolerance_y_m,
      from_y: -1000 * tolerance_z_m,
      to_y: 1000 * tolerance_z_m,
    };
    const lost = rows.filter(row => !isSuccess(row));
    return {
      equal: true,
      x: {label: 'y, mm', low: -reach, high: reach, clamped: true},
      y: {label: 'z, mm', low: -reach, high: reach, clamped: true},
      blocks: [{...square, color: [46, 139, 87], opacity: 0.16}],
      series: [
        points('failed', lost, {color: curve(1), mark: 'rings'}),
        points('success', won, {color: curve(0), mark: 'dots'}),
      ],
    };
  }

  /** Of the table. */
  columns() {
    const {trials} = this;
    const {get} = trials;
    const isNumeric = key => trials.isNumeric(key);
    const numeric = (key, name, width) => {
      const value = row => (get[key](row) === null ? null : get[key](row) * name.factor);
      return {key, label: titled(name), title: key, width, isNumeric: true, value};
    };
    const word = (key, isChoice, text = row => String(get[key](row) ?? '–')) => ({
      key,
      label: trials.names[key].label,
      title: key,
      value: get[key],
      text,
      choices: isChoice ? trials.values(key) : null,
    });
    const named = key => word(key, true, row => words(get[key](row) ?? '–'));
    const digits = String(get.trial(this.model.rows - 1)).length;
    const width = key => `${Math.max(96, 8 * titled(trials.names[key]).length + 24)}px`;
    return [
      {
        ...numeric('trial', trials.names.trial, `${Math.max(74, 9 * digits + 20)}px`),
        text: row => String(get.trial(row)),
      },
      named('outcome'),
      named('failure'),
      ...trials.parameters.map(key =>
        isNumeric(key)
          ? numeric(key, trials.names[key], width(key))
          : word(key, trials.values(key).length < 30),
      ),
      numeric('time_s', trials.names.time_s),
      {key: 'reason', label: 'reason', value: row => spoken(get.reason?.(row)), width: '280px'},
      ...trials.columns
        .filter(key => !kShownElsewhere.includes(key) && isNumeric(key))
        .map(key => numeric(key, trials.names[key], width(key))),
      {key: 'seed', label: 'seed', value: get.seed, width: '190px'},
    ];
  }

  /** Shows a trial below the table. */
  pick(row) {
    const {model, trials} = this;
    const {get} = trials;
    const trial = get.trial(row);
    const series = `series--${trial}`;
    const isThere = has(series);
    const fact = (label, value) => ({label, value: String(value ?? '–')});
    const replay = {
      what: 'The trial again, with film and all its files',
      command: `${model.replay} ${trial} --out out/${trial}`,
    };
    const elsewhere = model.series_stored
      ? `This page has the traces of ${model.series_trials.length} of ${model.series_stored} trials, failures first: ` +
        'the command above makes its own.'
      : 'The batch stored no traces (series_every_frames in its plan): the command above makes them.';
    return openTrials(this.detail, {
      trials: [
        {
          title: `Trial ${trial}`,
          outcome: get.outcome(row),
          reason: get.reason?.(row) || '',
          facts: [
            fact('failure', words(get.failure(row))),
            fact('time', clockText(get.time_s?.(row))),
            fact('seed', get.seed(row)),
            ...trials.parameters.map(key => {
              const {label, unit, factor} = trials.names[key];
              const value = get[key](row);
              const text = typeof value === 'number' ? shown(value * factor) : shown(value);
              return {label, value: measured(text, unit), note: key};
            }),
          ],
          commands: model.replay ? [replay] : [],
          note: isThere ? '' : elsewhere,
          ...(isThere ? {model: `model--${get.scenario?.(row) ?? ''}`, series} : {}),
        },
      ],
    });
  }
}

const timesOf = groups => ({
  x: {label: 'time to dock, s'},
  y: {label: 'trials', low: 0, whole: true},
  series: [
    {
      name: '',
      mark: 'columns',
      color: curve(0),
      x: groups.map(({low, high}) => (low + high) / 2),
      y: groups.map(({rows}) => rows.length),
      low: groups.map(({low}) => low),
      high: groups.map(({high}) => high),
      members: groups.map(({rows}) => rows),
    },
  ],
});
