// A gate: did docking get worse? The verdict, how the sequential test came to it, and what failed.

import {h, button, fill, section} from 'page/dom.js';
import {load} from 'page/data.js';
import {fixed, number, percent, words} from 'page/format.js';
import {command} from 'page/parts.js';
import {Series} from 'page/series.js';
import {show as showStudy} from 'page/study.js';
import {curve, kTones} from 'page/theme.js';
import {TrialView} from 'page/trial.js';

const value = (m, v) =>
  v === null || v === undefined
    ? 'none'
    : m.unit === ''
      ? percent(v, 1)
      : m.unit === 'm'
        ? `${fixed(1000 * v, 1)} mm`
        : `${fixed(v, {F: 3, V: 2}[m.unit] ?? 1)} ${m.unit}`;
const margin = m =>
  (m.less_is_worse ? '-' : '+') +
  (m.unit === ''
    ? `${number(100 * m.margin)} %`
    : m.unit === 'm'
      ? `${number(1000 * m.margin)} mm`
      : `${number(m.margin)} ${m.unit}`);
const toneOf = verdict => ({pass: 'good', fail: 'bad'})[verdict] || 'none';

function pathPanel(c) {
  const run = c.path.filter(look => look.worse !== null).length; // and as far again, to see the borders
  const shown = c.path.slice(0, Math.max(run + 5, Math.min(c.path.length, Math.ceil(1.6 * run))));
  const at = key => shown.map(look => look[key] ?? null);
  const trials = at('trials');
  const counted = c.paired ? 'seeds that no longer dock' : 'trials that did not dock';
  return {
    title: c.condition,
    legend: 'none',
    rules: [],
    x: {label: 'trials', low: 0, whole: true},
    y: {label: counted, low: -0.4, least_span: 3, whole: true},
    series: [
      {
        name: 'fails from here',
        x: trials,
        y: at('fails_at'),
        color: kTones.bad,
        mark: 'dashed_steps',
        width: 2,
      },
      {
        name: 'passes up to here',
        x: trials,
        y: at('passes_at'),
        color: kTones.good,
        mark: 'dashed_steps',
        width: 2,
      },
      {name: 'so far', x: trials, y: at('worse'), color: curve(0), mark: 'steps', width: 2.5},
    ],
  };
}

export function show(host, model) {
  const r = model.result;
  const verdict = r.verdict;
  const conditions = r.conditions;
  const sentence = {
    pass: 'No measure got worse by its margin.',
    fail: 'At least one measure got worse.',
    inconclusive: 'The trials allowed were spent before it was known.',
  }[verdict];
  const rows = conditions.flatMap(c =>
    c.measures.map(m => [
      c.condition,
      m.measure,
      value(m, m.before),
      value(m, m.now),
      margin(m),
      String(m.compared),
      String(m.worse),
      String(m.better),
      {text: m.verdict === 'inconclusive' ? 'not known' : m.verdict, tone: toneOf(m.verdict)},
      m.decided_after_trials ? `after ${m.decided_after_trials} trials` : '–',
    ]),
  );
  const names = conditions.map(c => c.condition);
  const share = (name, docked, trials, interval, shift, color) => ({
    name,
    color,
    mark: 'bars',
    dot: 8,
    x: conditions.map((_, i) => i + shift),
    y: conditions.map(
      c => (100 * c[docked]) / (Array.isArray(c[trials]) ? c[trials].length : c[trials]),
    ),
    low: conditions.map(c => 100 * c[interval][0]),
    high: conditions.map(c => 100 * c[interval][1]),
  });
  const times = (outcomes, key, f) =>
    outcomes.filter(t => t.outcome === 'docked').map(t => t[key] * f);
  const sections = [
    {
      title: 'Verdicts',
      wide: true,
      table: {
        columns: [
          'condition',
          'measure',
          'baseline',
          'now',
          'margin',
          'compared',
          'worse',
          'better',
          'verdict',
          'known',
        ].map((label, k) => ({label, numeric: k > 1 && k < 8})),
        rows,
      },
    },
    ...(conditions.some(c => c.path?.length)
      ? [
          {
            title: 'How the test of the success rate went',
            wide: true,
            height: 230,
            note:
              'The line is what was counted so far. Once it reaches the upper border the gate fails, ' +
              'at the lower one it passes; between them it asks for more trials.',
            panels: conditions.filter(c => c.path?.length).map(pathPanel),
          },
        ]
      : []),
    {
      title: 'Docked, baseline and now',
      note: 'With 95 % intervals.',
      panels: [
        {
          x: {names},
          y: {label: 'docked, %', low: -3, high: 103},
          legend: 'none',
          rules: [],
          series: [
            share(
              'baseline',
              'baseline_docked',
              'baseline_trials',
              'baseline_interval_95',
              -0.1,
              curve(7),
            ),
            share('now', 'docked', 'trials', 'interval_95', 0.1, curve(0)),
          ],
        },
      ],
    },
    ...(conditions.some(c => c.docked > 0)
      ? [
          {
            title: 'Time to dock now',
            note: 'Of the trials that docked; one dot a trial, conditions in order.',
            panels: [
              {
                x: {names},
                y: {label: 's', low: 0},
                legend: 'none',
                rules: [],
                series: [
                  {
                    name: '',
                    color: curve(0),
                    mark: 'dots',
                    dot: 5,
                    ...spread(conditions.map(c => times(c.outcomes, 'time_s', 1))),
                  },
                ],
              },
            ],
          },
        ]
      : []),
    {
      title: 'Seeds that changed',
      list: conditions.flatMap(c => [
        c.newly_failing_seeds.length
          ? `${c.condition}: no longer dock: ${c.newly_failing_seeds.join(', ')}`
          : `${c.condition}: none that docked before fails now`,
        ...(c.newly_docking_seeds.length
          ? [`${c.condition}: dock now: ${c.newly_docking_seeds.join(', ')}`]
          : []),
      ]),
    },
  ];
  const reasons = conditions
    .filter(c => c.verdict !== 'pass')
    .map(
      c =>
        `${c.condition}: ${c.measures
          .filter(m => m.verdict === c.verdict)
          .map(m => `${m.measure} ${value(m, m.before)} → ${value(m, m.now)}`)
          .join(', ')}`,
    );
  const view = showStudy(host, {
    ...model,
    badge: {word: verdict, tone: toneOf(verdict)},
    reason: `${sentence} ${reasons.join('; ')}`.trim(),
    note: (r.assignments || []).join(', '),
    facts: [
      ['conditions', String(conditions.length)],
      [
        'trials',
        String(
          conditions.reduce(
            (n, c) => n + (Array.isArray(c.trials) ? c.trials.length : c.trials),
            0,
          ),
        ),
      ],
      [
        'no longer dock',
        String(conditions.reduce((n, c) => n + c.newly_failing_seeds.length, 0)),
        'seeds',
      ],
      ['build', r.build],
      ['baseline', r.baseline_build],
    ],
    sections,
  });
  const failures = model.failures || [];
  if (failures.length) {
    const detail = h('div', {class: 'column'});
    host.append(
      section(
        'Failures, run again',
        {wide: true, note: 'Seeds that docked in the baseline and no longer do.'},
        h(
          'ul',
          {class: 'failures'},
          failures.map(f =>
            h(
              'li',
              {},
              button(`${f.name}`, () => open(f, detail), {class: 'link', title: `show ${f.name}`}),
              ` ${words(f.outcome)}: ${f.reason}`,
              command(f.command),
            ),
          ),
        ),
      ),
      detail,
    );
    view.open = name =>
      open(
        failures.find(f => f.name === name),
        detail,
      );
  }
  return view;
}

async function open(failure, detail) {
  const trial = await load(`trial-${failure.name}`);
  fill(detail);
  const place = h('div', {class: 'column', tabindex: -1});
  detail.append(place);
  const view = new TrialView(place, trial, {
    series: new Series(trial.series),
    frames: trial.frames,
  });
  view.clock.seek(Math.max(0, view.series.end - 0.5));
  place.scrollIntoView({block: 'start'});
  place.focus({preventScroll: true});
}

/** Lists as dots side by side about 0, 1, 2, ... */
function spread(lists) {
  const x = [];
  const y = [];
  lists.forEach((list, i) =>
    list.forEach((v, k) => {
      x.push(i - 0.25 + (0.5 * (k + 0.5)) / list.length);
      y.push(v);
    }),
  );
  return {x, y};
}
