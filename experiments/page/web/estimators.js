// Estimators on the same frames: how many markers they find, how exactly, how fast.

import {fixed, number, percent} from 'page/format.js';
import {show as showStudy} from 'page/study.js';
import {curve} from 'page/theme.js';

const distinct = (rows, of) => [...new Set(rows.map(of))];
const kMeasures = [
  [
    'found, %',
    r => [(100 * r.found) / r.starts, ...r.found_interval.map(v => 100 * v)],
    {low: -3, high: 103},
  ],
  [
    'median error, mm',
    r => [1000 * r.error_median_m, ...r.error_median_interval_m.map(v => 1000 * v)],
    {logarithmic: true},
  ],
  [
    'median error, °',
    r => [r.rotation_median_rad, ...r.rotation_median_interval_rad].map(v => (v * 180) / Math.PI),
    {logarithmic: true},
  ],
  ['processor time of a frame, ms', r => [1000 * r.frame_s, NaN, NaN], {low: 0}],
];

export function show(host, model) {
  const cells = model.result.cells;
  const names = distinct(cells, r => r.estimator);
  const sections = [];
  for (const marker of distinct(cells, r => r.marker))
    for (const distance of distinct(
      cells.filter(r => r.marker === marker),
      r => r.distance_mm,
    )) {
      const own = cells.filter(r => r.marker === marker && r.distance_mm === distance);
      const one = distinct(own, r => r.milk_ml_m3).length === 1;
      const lines = of =>
        names.map((name, k) => {
          const rows = own.filter(r => r.estimator === name);
          const values = rows.map(of);
          return {
            name,
            color: curve(k),
            mark: 'line_with_bars',
            dot: 6,
            x: rows.map(r => (one ? k : r.milk_ml_m3)),
            y: values.map(v => v[0]),
            low: values.map(v => v[1]),
            high: values.map(v => v[2]),
          };
        });
      sections.push({
        title: `${marker} marker, ${distance > 0 ? `${number(distance)} mm` : 'any distance'}`,
        wide: true,
        height: 230,
        columns: 2,
        panels: kMeasures.map(([label, of, y]) => ({
          x: one ? {names} : {label: 'milk, ml/m³'},
          y: {label, ...y},
          legend: 'none',
          rules: [],
          series: lines(of),
        })),
      });
    }
  const best = [...names]
    .map(name => {
      const rows = cells.filter(r => r.estimator === name);
      return {
        name,
        found: rows.reduce((n, r) => n + r.found, 0),
        starts: rows.reduce((n, r) => n + r.starts, 0),
        ms: (1000 * rows.reduce((n, r) => n + r.frame_s, 0)) / rows.length,
        error: rows.map(r => r.error_median_m).sort((a, b) => a - b)[rows.length >> 1],
      };
    })
    .sort((a, b) => b.found / b.starts - a.found / a.starts);
  sections.unshift(
    {
      title: 'All cells together',
      table: {
        columns: ['estimator', 'found', '', 'median error, mm', 'ms a frame'].map((label, k) => ({
          label,
          numeric: k > 0,
        })),
        rows: best.map(b => [
          b.name,
          `${b.found}/${b.starts}`,
          percent(b.found / b.starts, 1),
          fixed(1000 * b.error, 1),
          fixed(b.ms, 2),
        ]),
      },
    },
    {
      title: 'How well F tells the error',
      note: 'Rank correlation of F with the error; -1: F tells it perfectly.',
      table: {
        columns: [{label: 'estimator'}, {label: 'marker'}, {label: 'Spearman', numeric: true}],
        rows: model.result.fitness_error_correlation.map(c => [
          c.estimator,
          c.marker,
          fixed(c.spearman, 2),
        ]),
      },
    },
  );
  sections.push({
    title: 'Cells',
    wide: true,
    table: {
      columns: [
        'estimator',
        'marker',
        'mm',
        'ml/m³',
        'found',
        'median error, mm',
        'worst, mm',
        'median error, °',
        'F',
        'ms a frame',
        'evaluations',
      ].map((label, k) => ({label, numeric: k > 1})),
      rows: cells.map(r => [
        r.estimator,
        r.marker,
        number(r.distance_mm),
        number(r.milk_ml_m3),
        `${r.found}/${r.starts}`,
        fixed(1000 * r.error_median_m, 1),
        fixed(1000 * r.error_worst_m, 1),
        fixed((r.rotation_median_rad * 180) / Math.PI, 2),
        fixed(r.fitness_mean, 2),
        fixed(1000 * r.frame_s, 2),
        fixed(r.evaluations_per_frame, 0),
      ]),
    },
  });
  return showStudy(host, {
    ...model,
    reason: `${names.length} estimators, ${cells.length} cells of ${cells[0]?.starts ?? 0} starts each.`,
    facts: best
      .slice(0, 4)
      .map(b => [b.name, `${percent(b.found / b.starts, 1)} found, ${fixed(b.ms, 1)} ms`]),
    sections,
  });
}
