// The recognition experiment: F over milk and distance, beside what was published.

import {fixed, number, percent} from 'page/format.js';
import {show as showStudy} from 'page/study.js';
import {curve} from 'page/theme.js';

const kAreas = {I: [60, 168, 110], II: [232, 184, 60], III: [150, 158, 166]};
const areaOf = f => (f >= 0.6 ? 'I' : f >= 0.22 ? 'II' : 'III');
const ascending = (a, b) => a - b;

export function show(host, model) {
  const cells = model.result.cells;
  const markers = [...new Set(cells.map(c => c.marker))];
  const limits = [
    [0.6, '0.60'],
    [0.22, '0.22'],
  ].map(([at, name]) => ({at, name, color: [46, 139, 87], mark: 'dashes'}));
  const sections = [];
  for (const marker of markers) {
    const own = cells.filter(c => c.marker === marker);
    const distances = [...new Set(own.map(c => c.distance_mm))].sort(ascending);
    const published = model.published?.[marker];
    const series = [];
    distances.forEach((distance, k) => {
      const line = own
        .filter(c => c.distance_mm === distance)
        .sort((a, b) => a.milk_ml_m3 - b.milk_ml_m3);
      series.push({
        name: `${number(distance)} mm`,
        color: curve(k),
        mark: 'line_with_bars',
        dot: 5,
        x: line.map(c => c.milk_ml_m3),
        y: line.map(c => c.fitness_mean),
        low: line.map(c => c.fitness_mean - c.fitness_std),
        high: line.map(c => c.fitness_mean + c.fitness_std),
      });
      if (!published) return;
      const rows = published.milk_ml_m3
        .map((_, i) => i)
        .filter(i => published.distance_mm[i] === distance);
      if (rows.length)
        series.push({
          name: `${number(distance)} mm, published`,
          color: curve(k),
          mark: 'rings',
          dot: 5,
          x: rows.map(i => published.milk_ml_m3[i]),
          y: rows.map(i => published.fitness_mean[i]),
        });
    });
    sections.push({
      title: `F over milk, ${marker} marker`,
      wide: markers.length === 1,
      height: 330,
      note: 'Mean and standard deviation of F; rings are the published means.',
      panels: [
        {
          x: {label: 'milk, ml/m³'},
          y: {label: 'F', low: -0.1, high: 1.02},
          legend: 'none',
          series,
          rules: limits,
        },
      ],
    });
    const milk = [...new Set(own.map(c => c.milk_ml_m3))].sort(ascending);
    const blocks = [];
    const points = {x: [], y: []};
    distances.forEach((distance, row) => {
      const line = own
        .filter(c => c.distance_mm === distance)
        .sort((a, b) => a.milk_ml_m3 - b.milk_ml_m3);
      line.forEach((c, i) => {
        const before = line[i - 1];
        const after = line[i + 1];
        const area = c.area || areaOf(c.fitness_mean);
        const last = blocks[blocks.length - 1];
        const x0 = before ? (before.milk_ml_m3 + c.milk_ml_m3) / 2 : c.milk_ml_m3;
        const x1 = after
          ? (after.milk_ml_m3 + c.milk_ml_m3) / 2
          : c.milk_ml_m3 + (before ? (c.milk_ml_m3 - before.milk_ml_m3) / 2 : 1);
        if (i > 0 && last.name === area)
          last.x1 = x1; // one block, wide enough for its name
        else
          blocks.push({
            name: area,
            x0,
            x1,
            y0: row - 0.4,
            y1: row + 0.4,
            color: kAreas[area],
            opacity: 0.85,
            ink: '#10161b',
          });
        points.x.push(c.milk_ml_m3);
        points.y.push(row - 0.3); // below the area's name
      });
    });
    sections.push({
      title: `Areas, ${marker} marker`,
      height: 60 + 40 * distances.length,
      note: 'Green: Area I, docking possible. Yellow: Area II, recognisable. Grey: Area III, not detected.',
      panels: [
        {
          x: {label: 'milk, ml/m³', low: 0, high: 1.03 * Math.max(1, ...milk)},
          y: {names: distances.map(d => `${number(d)} mm`)},
          legend: 'none',
          rules: [],
          blocks,
          series: [{name: '', ...points, color: [20, 30, 40], mark: 'dots', dot: 2}],
        },
      ],
    });
  }
  const r = model.result;
  const compared = r.rmse !== undefined;
  sections.push({
    title: 'Cells',
    wide: true,
    table: {
      columns: [
        'cell',
        'milk, ml/m³',
        'distance, mm',
        'F',
        'deviation',
        'Area',
        'position error, mm',
        ...(compared ? ['F of the table'] : []),
      ].map((label, k) => ({label, numeric: k > 0 && k !== 5})),
      rows: cells.map(c => [
        c.marker,
        number(c.milk_ml_m3),
        number(c.distance_mm),
        fixed(c.fitness_mean, 3),
        fixed(c.fitness_std, 3),
        c.area,
        fixed(1000 * c.position_error_mean_m, 1),
        ...(compared ? [fixed(c.reference_mean, 3)] : []),
      ]),
    },
  });
  const most = (marker, area) =>
    Math.max(
      ...cells
        .filter(c => c.marker === marker && (c.area === area || (area === 'II' && c.area === 'I')))
        .map(c => c.milk_ml_m3),
    );
  return showStudy(host, {
    ...model,
    reason: `${cells.length} cells of ${markers.join(' and ')} marker.`,
    facts: [
      ...markers.flatMap(m =>
        ['I', 'II'].map(area => [
          `${m}: Area ${area} up to`,
          Number.isFinite(most(m, area)) ? `${number(most(m, area))} ml/m³` : 'nowhere',
          'the most milk of any distance',
        ]),
      ),
      ...(compared
        ? [
            ['RMSE against the table', fixed(r.rmse, 3)],
            ['same Area', percent(r.area_agreement)],
          ]
        : []),
    ],
    sections,
  });
}
