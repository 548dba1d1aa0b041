// A tuning study: how the search converged, which gains it found, what they are worth on seeds it never saw.

import {fixed, number, percent, words} from 'page/format.js';
import {show as showStudy} from 'page/study.js';
import {curve} from 'page/theme.js';

const pText = p => (p === undefined ? '–' : p < 0.001 ? p.toExponential(1) : fixed(p, 3));
const span = c =>
  `${fixed(c.mean, 2)} [${fixed(c.confidence_95[0], 2)}, ${fixed(c.confidence_95[1], 2)}]`;
const docked = s =>
  `${s.successes}/${s.trials} [${fixed(100 * s.success_95[0], 0)}, ${fixed(100 * s.success_95[1], 0)}] %`;

const clockOrNone = s => (Number.isFinite(s) ? `${fixed(s, 1)} s` : '–');

function shareOf(range, value) {
  return range.scale === 'log'
    ? Math.log(value / range.low) / Math.log(range.high / range.low)
    : (value - range.low) / (range.high - range.low);
}

function comparisons(list) {
  return {
    columns: [
      'trials',
      'docked, before',
      'docked, tuned',
      'time, before',
      'time, tuned',
      'cost difference [95 %]',
      'p (t)',
      'p (Wilcoxon)',
      'p (McNemar)',
    ].map((label, k) => ({label, numeric: k > 0})),
    rows: list.map(c => [
      c.what,
      docked(c.start),
      docked(c.tuned),
      clockOrNone(c.start.time_s_median),
      clockOrNone(c.tuned.time_s_median),
      {
        text: span(c.cost_difference),
        tone:
          c.cost_difference.confidence_95[1] < 0
            ? 'good'
            : c.cost_difference.confidence_95[0] > 0
              ? 'bad'
              : '',
      },
      pText(c.cost_difference.t_p),
      pText(c.cost_difference.wilcoxon_p),
      pText(c.mcnemar_p),
    ]),
  };
}

export function show(host, model) {
  const r = model.result;
  const generations = r.generations;
  const ranges = r.ranges || null;
  const missing = [...model.missing];
  const keys = Object.keys(r.tuned);
  const trials = generations.map(g => g.trials);
  if (!ranges)
    missing.push(
      'An older program wrote this study, without the gains’ ranges: ' +
        'their way is shown as a share of the largest value.',
    );
  const way = key =>
    generations.map(g =>
      ranges
        ? shareOf(
            ranges.find(x => x.key === key),
            g.gains[key],
          )
        : g.gains[key] / Math.max(...generations.map(x => Math.abs(x.gains[key])), 1e-12),
    );
  const line = (name, y, color, mark = 'line', more = {}) => ({
    name,
    x: trials,
    y,
    color,
    mark,
    ...more,
  });
  const first = generations[0]?.incumbent ?? 0;
  const held = r.held_out;
  const top = Math.max(0, ...generations.map(g => Math.max(1.2 * g.best, 1.2 * g.incumbent)));
  const sections = [];
  if (held)
    sections.push({
      title: 'Before and after, on held-out seeds',
      wide: true,
      note:
        'Differences are tuned less before on the same seeds; docked with Wilson’s 95 % intervals; ' +
        'times are medians of the trials that docked.',
      table: comparisons([held]),
    });
  if (generations.length)
    sections.push(
      {
        title: 'Convergence',
        panels: [
          {
            x: {label: 'trials'},
            y: {label: 'cost of a trial', low: 0, high: top || 1},
            legend: 'none',
            rules: [],
            series: [
              line(
                'median of the generation',
                generations.map(g => g.median),
                [140, 148, 156],
              ),
              line(
                'its best',
                generations.map(g => g.best),
                curve(0),
                'line_with_dots',
                {dot: 5},
              ),
              line(
                'incumbent, same trials',
                generations.map(g => g.incumbent),
                curve(2),
              ),
              line(
                'takes its place',
                generations.map(g => (g.replaced ? g.best : null)),
                curve(1),
                'rings',
                {dot: 9},
              ),
              line(
                'start less gains on new trials',
                generations.map(g => first - g.gained),
                curve(1),
                'dashed_steps',
              ),
            ],
          },
        ],
      },
      {
        title: 'The gains’ way',
        note: 'Of the incumbent, as a share of each gain’s range.',
        panels: [
          {
            x: {label: 'trials'},
            y: {low: 0, high: 1},
            legend: 'none',
            rules: [],
            series: keys.map((key, i) =>
              line(key, way(key), curve(i), i < 8 ? 'steps' : 'dashed_steps'),
            ),
          },
        ],
      },
    );
  sections.push({
    title: 'Gains',
    table: {
      columns: [
        {label: 'gain'},
        {label: 'range', numeric: true},
        {label: 'start', numeric: true},
        {label: 'tuned', numeric: true},
      ],
      rows: keys.map(key => {
        const x = ranges?.find(range => range.key === key);
        return [
          key,
          x ? `${number(x.low)} to ${number(x.high)}${x.scale === 'log' ? ', log' : ''}` : '–',
          number(r.start[key]),
          number(r.tuned[key]),
        ];
      }),
    },
  });
  if (r.sensitivity.length) {
    const bars = (name, key, shift, color) => ({
      name,
      color,
      mark: 'bars',
      dot: 7,
      x: r.sensitivity.map((_, i) => i + shift),
      y: r.sensitivity.map(s => s[key].mean),
      low: r.sensitivity.map(s => s[key].confidence_95[0]),
      high: r.sensitivity.map(s => s[key].confidence_95[1]),
    });
    sections.push({
      title: 'Each gain alone',
      note: 'Added cost when one gain leaves its tuned value by a step; above zero: the tuned value is better.',
      height: 300,
      panels: [
        {
          x: {names: r.sensitivity.map(s => s.key)},
          y: {label: 'added cost'},
          legend: 'none',
          rules: [{at: 0, color: [140, 148, 156], mark: 'line'}],
          series: [
            bars('a step down', 'cost_down', -0.12, curve(0)),
            bars('a step up', 'cost_up', 0.12, curve(1)),
          ],
        },
      ],
    });
  }
  if (r.pareto_front.length) {
    const axes = r.objective || [{metric: 'first objective'}, {metric: 'second objective'}];
    sections.push({
      title: 'The front',
      note: 'Gains that no others beat in every objective; the fuller the blue, the more of their trials docked.',
      panels: [
        {
          legend: 'none',
          rules: [],
          x: {label: `${words(axes[0].metric)}, weighted`},
          y: {label: `${words(axes[1].metric)}, weighted`},
          series: [
            {
              name: '',
              x: r.pareto_front.map(p => p.worth[0]),
              y: r.pareto_front.map(p => p.worth[1]),
              shade: r.pareto_front.map(p => 100 * p.success),
              color: curve(0),
              mark: 'dots',
              dot: 10,
              scale: {label: 'docked, %', low: 0, high: 100, from: curve(1), to: curve(0)},
            },
          ],
        },
      ],
    });
  }
  if (r.robustness.length)
    sections.push({
      title: 'When the vehicle or the sea is another',
      wide: true,
      table: comparisons(r.robustness),
    });
  if (r.objective)
    sections.push({
      title: 'What a trial costs',
      list: r.objective.map(
        o =>
          `${number(o.weight)} × |${o.metric}|` +
          (o.failed ? `, of a trial that failed ${number(o.failed)} more of it` : ''),
      ),
    });
  const gained = held
    ? held.cost_difference.confidence_95[1] < 0
      ? {word: 'better on held-out seeds', tone: 'good'}
      : held.cost_difference.confidence_95[0] > 0
        ? {word: 'worse on held-out seeds', tone: 'bad'}
        : {word: 'no significant difference', tone: 'none'}
    : null;
  return showStudy(host, {
    ...model,
    missing,
    badge: gained,
    reason: held
      ? `Tuned gains cost ${span(held.cost_difference)} a trial against before, ` +
        `over ${held.cost_difference.pairs} pairs.`
      : 'The study has no proof on held-out seeds.',
    facts: [
      ['gains', String(keys.length)],
      ['trials', String(r.trials)],
      ['generations', String(generations.length)],
      ...(r.algorithm ? [['algorithm', words(r.algorithm)]] : []),
      ...(held
        ? [
            ['docked before', percent(held.start.successes / held.start.trials, 1)],
            ['docked tuned', percent(held.tuned.successes / held.tuned.trials, 1)],
          ]
        : []),
      ['study', r.study_hash],
    ],
    sections,
  });
}
