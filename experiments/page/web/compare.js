// Two batches on the same seeds, pair by pair: what changed, significant first, and which seeds flipped.

import {h, fill, section} from 'page/dom.js';
import {load} from 'page/data.js';
import {Clock} from 'page/clock.js';
import {clockText, fixed, number, percent, quantity, words} from 'page/format.js';
import {badge, command, facts} from 'page/parts.js';
import {Series} from 'page/series.js';
import {curve} from 'page/theme.js';
import {show as showStudy} from 'page/study.js';
import {TrialView} from 'page/trial.js';

const nameOf = group =>
  Object.entries(group)
    .map(([key, value]) => `${key} = ${value}`)
    .join(', ') || 'all';
const points = share => fixed(100 * share, 1);
const pText = p => (p < 0.001 ? p.toExponential(1) : fixed(p, 3));

/** Holm's correction: which of the p values are significant together at 0.05. */
function holm(values, level = 0.05) {
  const order = values.map((p, i) => [p, i]).sort((a, b) => a[0] - b[0]);
  const significant = values.map(() => false);
  for (let k = 0; k < order.length && order[k][0] <= level / (order.length - k); ++k)
    significant[order[k][1]] = true;
  return significant;
}

/** Exact two-sided McNemar test of pairs that changed one way and the other. */
export function mcnemar(lost, gained) {
  const n = lost + gained;
  let tail = 0;
  let log = 0; // of C(n, k)
  for (let k = 0; k <= Math.min(lost, gained); ++k) {
    tail += Math.exp(log - n * Math.LN2);
    log += Math.log((n - k) / (k + 1));
  }
  return Math.min(1, 2 * tail);
}

export function show(host, model) {
  const r = model.result;
  const changes = [];
  for (const g of r.groups) {
    const group = nameOf(g.group);
    changes.push({
      group,
      what: 'docked',
      a: percent(g.rate_a, 1),
      b: percent(g.rate_b, 1),
      pairs: g.pairs,
      p: g.p_value,
      size: g.difference,
      better: g.difference > 0,
      difference: `${points(g.difference)} points [${g.interval_95.map(points).join(', ')}]`,
    });
    for (const m of g.metrics) {
      if (m.median_difference === null || m.pairs === 0) continue;
      const {label, unit, factor} = quantity(m.metric);
      const span = m.interval_95
        ? ` [${number(m.interval_95[0] * factor, 3)}, ${number(m.interval_95[1] * factor, 3)}]`
        : '';
      changes.push({
        group,
        what: `${label}${unit ? `, ${unit}` : ''}`,
        a: number(m.median_a * factor),
        b: number(m.median_b * factor),
        pairs: m.pairs,
        p: m.p_value,
        size: m.median_difference,
        difference: `${number(m.median_difference * factor, 3)}${span}`,
      });
    }
  }
  const several = r.groups.length > 1;
  const total = r.groups.reduce(
    (sum, g) => ({
      pairs: sum.pairs + g.pairs,
      a: sum.a + g.rate_a * g.pairs,
      b: sum.b + g.rate_b * g.pairs,
      lost: sum.lost + g.lost.length,
      gained: sum.gained + g.gained.length,
    }),
    {pairs: 0, a: 0, b: 0, lost: 0, gained: 0},
  );
  if (several)
    changes.push({
      group: 'all together',
      what: 'docked',
      a: percent(total.a / total.pairs, 1),
      b: percent(total.b / total.pairs, 1),
      pairs: total.pairs,
      p: mcnemar(total.lost, total.gained),
      size: total.b - total.a,
      better: total.b > total.a,
      difference: `${fixed((100 * (total.b - total.a)) / total.pairs, 1)} points`,
    });
  // docking is what it is about; the other figures are a family of their own
  for (const family of [
    changes.filter(c => c.what === 'docked'),
    changes.filter(c => c.what !== 'docked'),
  ])
    holm(family.map(c => c.p)).forEach((significant, i) => {
      family[i].significant = significant;
    });
  changes.sort(
    (x, y) =>
      y.significant - x.significant || (y.what === 'docked') - (x.what === 'docked') || x.p - y.p,
  );
  const rate = g => g.rate_b - g.rate_a;
  const docks = changes.filter(c => c.what === 'docked');
  const worse = docks.filter(c => c.significant && !c.better);
  const better = docks.filter(c => c.significant && c.better);
  const verdict = worse.length
    ? {word: 'docks less', tone: 'bad'}
    : better.length
      ? {word: 'docks more', tone: 'good'}
      : {word: 'no significant change in docking', tone: 'none'};
  const keys = [...new Set(r.groups.flatMap(g => Object.keys(g.group)))]; // one says itself under the axis
  const x =
    keys.length === 1
      ? {label: keys[0], names: r.groups.map(g => String(g.group[keys[0]]))}
      : {names: r.groups.map(g => nameOf(g.group))};
  const ends = r.groups.flatMap(g => [0, ...g.interval_95]).map(x => 100 * x); // zero is to be seen
  const bars = (name, key, shift, color) => ({
    name,
    color,
    mark: 'dots',
    dot: 9,
    x: r.groups.map((_, i) => i + shift),
    y: r.groups.map(g => 100 * g[key]),
  });
  const flips = [];
  const detail = h('div', {class: 'column', id: 'flip'});
  for (const g of r.groups)
    for (const kind of ['lost', 'gained'])
      for (const t of g[kind])
        flips.push([
          {
            text: String(t.seed),
            title: `show seed ${t.seed} in both`,
            onclick: () => open(model, t, kind, detail),
          },
          {text: kind, tone: kind === 'lost' ? 'bad' : 'good'},
          ...(several ? [nameOf(g.group)] : []),
          String(t.trial_a),
          String(t.trial_b),
          words(t.failure),
        ]);
  const sections = [
    {
      title: 'Docked',
      note: `Share of the pairs${keys.length === 1 ? ` over ${keys[0]}` : ''}.`,
      panels: [
        {
          x,
          y: {label: 'docked, %', low: -3, high: 103},
          legend: 'none',
          rules: [],
          series: [bars('A', 'rate_a', -0.08, curve(0)), bars('B', 'rate_b', 0.08, curve(1))],
        },
      ],
    },
    {
      title: 'Difference in docking',
      note: 'In points, with 95 % intervals.',
      panels: [
        {
          x,
          y: {label: 'B less A, points', low: Math.min(...ends) - 4, high: Math.max(...ends) + 4},
          legend: 'none',
          rules: [{at: 0, color: [140, 148, 156], mark: 'line'}],
          series: [
            {
              name: '',
              color: curve(2),
              mark: 'bars',
              dot: 8,
              x: r.groups.map((_, i) => i),
              y: r.groups.map(g => 100 * rate(g)),
              low: r.groups.map(g => 100 * g.interval_95[0]),
              high: r.groups.map(g => 100 * g.interval_95[1]),
            },
          ],
        },
      ],
    },
    {
      title: 'What changed',
      wide: true,
      note:
        'B less A on the same seeds and parameters; significant ones first (exact McNemar and sign ' +
        'tests; by Holm, 5 % over the rows of docking and 5 % over all others). Figures are medians ' +
        'of pairs that docked in both.',
      table: {
        columns: [
          ...(several ? [{label: 'group'}] : []),
          {label: 'what'},
          {label: 'A', numeric: true},
          {label: 'B', numeric: true},
          {label: 'difference [95 %]', numeric: true},
          {label: 'pairs', numeric: true},
          {label: 'p', numeric: true},
          {label: ''},
        ],
        rows: changes.map(c => [
          ...(several ? [c.group] : []),
          c.what,
          c.a,
          c.b,
          c.difference,
          String(c.pairs),
          pText(c.p),
          c.significant
            ? {text: 'significant', tone: c.what === 'docked' ? (c.better ? 'good' : 'bad') : ''}
            : '',
        ]),
      },
    },
    {
      title: 'Seeds that flipped',
      wide: true,
      note: flips.length
        ? 'Lost: docked in A only. Gained: in B only. The reason is that of the side which failed. ' +
          'Click a seed to see it in both, with the commands that run it again.'
        : 'None: every seed ended the same way in both.',
      table: flips.length
        ? {
            columns: [
              {label: 'seed'},
              {label: ''},
              ...(several ? [{label: 'group'}] : []),
              {label: 'trial in A', numeric: true},
              {label: 'trial in B', numeric: true},
              {label: 'why'},
            ],
            rows: flips,
          }
        : null,
    },
  ];
  const view = showStudy(host, {
    ...model,
    badge: verdict,
    reason: `A: ${r.a} (${r.build_a}). B: ${r.b} (${r.build_b}).`,
    facts: [
      ['pairs', String(r.pairs)],
      ['A docked', percent(total.a / total.pairs, 1)],
      ['B docked', percent(total.b / total.pairs, 1)],
      ['lost', String(total.lost), 'docked in A only'],
      ['gained', String(total.gained), 'docked in B only'],
      ['significant changes', String(changes.filter(c => c.significant).length)],
    ],
    sections,
  });
  host.append(detail);
  return view;
}

/** A seed that ended differently: what happened in A, what in B, at the same time of one clock. */
async function open(model, pair, kind, detail) {
  const won = kind === 'lost' ? 'A' : 'B';
  const clock = new Clock();
  const box = h('div', {class: 'column', tabindex: -1});
  fill(detail, box);
  box.append(
    section(`Seed ${pair.seed}`, {
      wide: true,
      note: `Docked in ${won} only; in ${won === 'A' ? 'B' : 'A'}: ${words(pair.failure)}.`,
    }),
  );
  const ends = [];
  for (const [side, trial] of [
    ['a', pair.trial_a],
    ['b', pair.trial_b],
  ]) {
    const files = model.sides?.[side];
    const known = files?.trials[trial];
    const part = `series-${side}-${trial}`;
    const file = files?.file ?? model.result[side];
    const base = known && files.models[known.scenario];
    const columns = base ? await load(part) : null;
    const head = section(
      `${side.toUpperCase()}: trial ${trial} of ${file}`,
      {wide: true},
      known
        ? h(
            'div',
            {class: 'head-title'},
            badge(known.outcome),
            h('span', {class: 'reason'}, known.reason),
          )
        : null,
      known
        ? facts([
            ['failure', words(known.failure)],
            ['time', clockText(known.time_s)],
            ...known.parameters,
          ])
        : null,
      !files || files.can_replay
        ? command(
            `turbidock replay ${file} ${trial} --out out/${side}${trial}`,
            'The trial again, with film and all its files',
          )
        : null,
      columns
        ? null
        : h(
            'p',
            {class: 'note'},
            !files
              ? 'Its traces are not in this page: give both files to turbidock report.'
              : files.series_stored
                ? `Its traces are not in this page: turbidock report ${file} --trial ${trial} ` +
                  'shows them, if they were stored.'
                : 'The batch stored no traces (series_every_frames in its plan): the command above makes them.',
          ),
    );
    box.append(head);
    if (!columns) continue;
    const view = new TrialView(
      box,
      {...base, record: null},
      {series: new Series(columns), clock, withHead: false},
    );
    ends.push(view.series.end);
  }
  clock.setEnd(Math.max(0, ...ends));
  clock.seek(Math.min(...ends) - 0.5); // where they part
  box.scrollIntoView({block: 'start'});
  box.focus({preventScroll: true});
}
