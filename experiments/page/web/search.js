// A tuning study while it runs: what its candidates cost so far, and where the gains went.

import {section} from 'page/dom.js';
import {fixed, number, percent, words} from 'page/format.js';
import {facts, plainTable} from 'page/parts.js';
import {Plot} from 'page/plot.js';
import {curve} from 'page/theme.js';

/**
 * Candidates in the order in which they were evaluated: [{phase, kind, generation, rows, cost, docked, gains, at}];
 * at: trials until then.
 */
export function evaluations(search, n, get) {
  const byCell = new Map();
  for (let i = 0; i < n; ++i)
    byCell.has(get.cell(i)) ? byCell.get(get.cell(i)).push(i) : byCell.set(get.cell(i), [i]);
  const success = i => get.failure(i) === 'none';
  const costOf = i =>
    search.objective.reduce(
      (sum, term) =>
        sum + term.weight * (Math.abs(get[term.metric]?.(i) ?? 0) + (success(i) ? 0 : term.failed)),
      0,
    );
  let at = 0;
  return [...byCell]
    .sort((a, b) => a[0] - b[0])
    .map(([, rows]) => {
      const phase = get.phase(rows[0]);
      const [, kind, generation, incumbent] =
        phase.match(/^(generation|challenge) (\d+)( incumbent)?$/) || [];
      const docked = rows.filter(success).length / rows.length;
      at += rows.length;
      return {
        phase,
        kind:
          kind === 'challenge'
            ? 'challenge'
            : incumbent
              ? 'incumbent'
              : kind
                ? 'candidate'
                : 'proof',
        generation: Number(generation),
        rows,
        docked,
        at,
        cost:
          rows.reduce((sum, i) => sum + costOf(i), 0) / rows.length +
          search.success_weight * Math.max(0, search.success_at_least - docked),
        gains: search.gains.map(gain => get[gain.key](rows[0])),
      };
    });
}

const shareOf = (range, value) =>
  range.scale === 'log'
    ? Math.log(value / range.low) / Math.log(range.high / range.low)
    : (value - range.low) / (range.high - range.low);

export function drawSearch(host, search, n, get) {
  const list = evaluations(search, n, get);
  const of = kind => list.filter(e => e.kind === kind);
  const candidates = of('candidate');
  const incumbents = of('incumbent');
  const most = Math.max(...list.map(e => e.rows.length));
  // its way: the incumbents', where every generation has its own; else the best so far that ran all trials
  let way = incumbents;
  if (incumbents.length < 2) {
    way = [];
    for (const e of [...incumbents, ...candidates]
      .filter(e => e.rows.length === most)
      .sort((a, b) => a.at - b.at))
      if (!way.length || e.cost < way[way.length - 1].cost) way.push(e);
  }
  if (!way.length) return;
  const now = list[list.length - 1];
  const first = way[0];
  const last = way[way.length - 1];
  const generation = Math.max(0, ...list.map(e => e.generation).filter(Number.isFinite));
  const top = 2.5 * Math.max(...way.map(e => e.cost));
  const dots = (name, points, color, mark, dot) => ({
    name,
    color,
    mark,
    dot,
    points,
    x: points.map(e => e.at),
    y: points.map(e => Math.min(e.cost, 0.98 * top)),
  });
  const x = {
    label: 'trials so far',
    low: 0,
    high: Math.max(...candidates.map(e => e.at), last.at) * 1.03,
  };
  const costs = section(
    'The search so far',
    {
      wide: true,
      note: 'A dot is a candidate: its mean cost of a trial. Those that cost much more stand at the upper edge.',
    },
    facts([
      ['now', words(now.phase)],
      [
        'generation',
        search.generations ? `${generation} of ${search.generations}` : String(generation),
      ],
      ['candidates', String(candidates.length)],
      ['cost at the start', fixed(first.cost, 2)],
      ['of the incumbent', `${fixed(last.cost, 2)}, ${percent(last.docked)} docked`],
    ]),
  );
  host.append(costs);
  new Plot(
    costs,
    {
      title: '',
      x,
      y: {label: 'cost of a trial', low: 0, high: top},
      legend: 'none',
      rules: [],
      series: [
        dots('candidates', candidates, curve(0), 'dots', 5),
        dots('incumbent', way, curve(2), 'line_with_dots', 5),
        dots('challenges on new trials', of('challenge'), curve(1), 'rings', 8),
      ],
    },
    {
      height: 230,
      points: true,
      label: 'cost of the candidates over the trials so far',
      readout: (s, i) =>
        `${s.points[i].phase}\ncost ${fixed(s.points[i].cost, 2)}, ` +
        `${percent(s.points[i].docked)} of ${s.points[i].rows.length} docked`,
    },
  );
  const gains = section('The gains’ way', {
    note: 'Of the incumbent, as a share of each gain’s range.',
  });
  host.append(gains);
  new Plot(
    gains,
    {
      title: '',
      x,
      y: {low: 0, high: 1},
      legend: 'none',
      rules: [],
      series: search.gains.map((range, k) => ({
        name: range.key,
        color: curve(k),
        mark: way.length > 1 ? 'steps' : 'dots',
        x: [...way.map(e => e.at), x.high / 1.03],
        y: [...way, last].map(e => shareOf(range, e.gains[k])),
      })),
    },
    {height: 230, points: true, label: 'gains of the incumbent over the trials so far'},
  );
  const table = section(
    'Gains',
    {},
    plainTable({
      columns: [
        {label: 'gain'},
        {label: 'range', numeric: true},
        {label: 'start', numeric: true},
        {label: 'now', numeric: true},
      ],
      rows: search.gains.map((range, k) => [
        range.key,
        `${number(range.low)} to ${number(range.high)}${range.scale === 'log' ? ', log' : ''}`,
        number(first.gains[k]),
        number(last.gains[k]),
      ]),
    }),
  );
  host.append(table);
  const proof = of('proof');
  if (proof.length)
    host.append(
      section(
        'The proof so far',
        {wide: true, note: 'Held-out seeds: first what was there before, then the tuned gains.'},
        plainTable({
          columns: [
            {label: 'trials'},
            {label: 'run', numeric: true},
            {label: 'docked', numeric: true},
            {label: 'cost of a trial', numeric: true},
          ],
          rows: proof.map(e => [
            e.phase,
            String(e.rows.length),
            percent(e.docked),
            fixed(e.cost, 2),
          ]),
        }),
      ),
    );
}
