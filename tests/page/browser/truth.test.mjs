// What pages say and show without an untruth: trials that saw nothing, batches that docked nothing, paper, forced
// colours. Reports of make_reports.sh, as for pages.test.mjs.

import assert from 'node:assert/strict';
import {test} from 'node:test';
import {open, sceneDrawn} from './opened.mjs';

test('a trial that never saw the marker: no noise, the truth in sight, the vehicle in the picture', async () => {
  const {page, complaints, close} = await open('lost', 1440);
  assert.match(await page.locator('h1').innerText(), /, seed 3$/);
  const value = async (within, label) =>
    (await page.locator(`${within} .facts div`).filter({hasText: label}).first().innerText())
      .split('\n')
      .pop();
  assert.match(await value('.head', 'true error'), /^x -?\d+, y -?\d+, z -?\d+ mm$/);
  assert.equal(await value('.head', 'pole in'), '-');
  assert.match(await value('.head', 'one could see'), /^0\.\d+ m$/);
  const all = 'section[aria-label="All figures"]';
  for (const label of ['overshoot', 'tracking rms', 'insertion depth', 'final error estimated'])
    assert.equal(await value(all, label), '-', label);
  const y = await page.evaluate(() => {
    const {series, y: axis} = globalThis.turbidock.stack.panels[1];
    const truth = series.find(s => s.name === 'truth').y;
    return {
      names: series.map(s => s.name),
      axis,
      low: Math.min(...truth),
      high: Math.max(...truth),
    };
  });
  assert.ok(y.names.indexOf('F too low') < y.names.indexOf('truth'), 'the truth is on top');
  assert.ok(y.axis.low <= y.low && y.axis.high >= y.high);
  await sceneDrawn(page);
  const places = await page.evaluate(() => {
    const {clock, scene, series} = globalThis.turbidock;
    return [0, series.end / 2, series.end].map(time => {
      clock.seek(time);
      const {x, y} = scene.vehicle.position.clone().project(scene.camera);
      return {x, y, gone: scene.trail.geometry.drawRange.count};
    });
  });
  for (const {x, y} of places) assert.ok(Math.abs(x) < 0.9 && Math.abs(y) < 0.9, `at ${x}, ${y}`);
  assert.ok(places[0].gone < places[1].gone && places[1].gone < places[2].gone, 'the way so far');
  assert.match(await page.locator('.scale-bar').innerText(), /^\d+ (cm|m)$/);
  assert.match(await page.locator('.scene-key').innerText(), /one could see 0\.\d+ m/);
  assert.ok(await page.evaluate(() => globalThis.turbidock.scene.sight.visible), 'and where to');
  await page.waitForFunction(() => /F is too low/.test(document.body.innerText));
  const [guess, estimate] = await page.evaluate(() =>
    ['F too low', 'estimate'].map(name => {
      const chip = [...document.querySelectorAll('.chip')].find(c => c.innerText.startsWith(name));
      return Number(getComputedStyle(chip.firstChild).opacity);
    }),
  );
  assert.ok(guess < 0.8 && estimate === 1, 'the legend is as faint as its dots');
  assert.deepEqual(complaints, []);
  await close();
});

test('a batch: names with units, bars of all, equal axes; none that docks, one trial', async () => {
  const {page, close} = await open('batch', 1440);
  const choices = await page
    .locator('section[aria-label="Success by anything"] option')
    .allInnerTexts();
  assert.ok(choices.includes('current surface velocity y, m/s'), choices.join('|'));
  const bars = await page
    .locator('.bar span')
    .evaluateAll(list => list.map(span => Number.parseFloat(span.style.width)));
  assert.ok(bars.length && bars.reduce((sum, width) => sum + width, 0) < 60, `${bars} % of all`);
  assert.equal(await page.locator('.bar-list').getByText('success').count(), 0);
  for (const title of await page.locator('h2, thead th').allInnerTexts())
    assert.doesNotMatch(title, /\w_\w|\[\d\]/, 'no key is a title');
  const {X, Y} = await page.evaluate(() => {
    const {X, Y} = globalThis.turbidock.errors;
    return {X: Math.abs(X.of(1) - X.of(0)), Y: Math.abs(Y.of(1) - Y.of(0))};
  });
  assert.ok(Math.abs(X - Y) < 0.01 * Y, `${X} and ${Y} pixels a mm`);
  assert.ok(
    await page.evaluate(() => globalThis.turbidock.errors.Y2 === globalThis.turbidock.errors.Y),
  );
  await close();
  const none = await open('none', 1440);
  assert.match(await none.page.locator('main').innerText(), /None of these succeeded/);
  const {places, farthest_mm} = await none.page.evaluate(() => {
    const {X, Y, box, panel} = globalThis.turbidock.errors;
    const {x, y} = panel.series[0];
    const share = (value, from, to) => (value - from) / (to - from);
    return {
      places: x.map((_, i) => [
        share(X.of(x[i]), box.left, box.right),
        share(Y.of(y[i]), box.bottom, box.top),
      ]),
      farthest_mm: x.reduce((most, value) => Math.max(most, Math.abs(value)), 0),
    };
  });
  assert.ok(farthest_mm > 200, `${farthest_mm} mm: as far as it is`);
  for (const share of places.flat()) assert.ok(share > 0 && share < 1, `${share}`);
  assert.ok(
    places.flat().some(share => share > 0.98 || share < 0.02),
    'at the edge',
  );
  assert.ok(!(await none.page.evaluate(() => globalThis.turbidock.times.canvas.offsetParent)));
  assert.doesNotMatch(await none.page.locator('.head').innerText(), /- (s|mm)/, 'no time of none');
  const columns = await none.page.evaluate(() =>
    globalThis.turbidock.table.columns.map(c => c.label),
  );
  for (const label of columns)
    assert.doesNotMatch(label, /estimated|overshoot/, 'noise has no column');
  const by = none.page.locator('section[aria-label="Success by anything"] select').last();
  assert.equal(await by.inputValue(), '', 'no curves by what was drawn');
  assert.deepEqual(none.complaints, []);
  await none.close();
  const single = await open('single', 1440);
  assert.match(await single.page.locator('main').innerText(), /All of them succeeded/);
  assert.match(await single.page.locator('#trials [role=status]').innerText(), /^1 trial\./);
  assert.match(
    await single.page.locator('main').innerText(),
    /Nothing varies between these trials/,
  );
  assert.deepEqual(single.complaints, []);
  await single.close();
});

test('curves that coincide are both seen', async () => {
  const {page, close} = await open('batch', 1440);
  const seen = await page.evaluate(() => {
    const canvas = [...document.querySelectorAll('.cards .plot canvas')][0];
    const c = canvas.getContext('2d');
    const {width, height} = canvas;
    // between the values that were run
    const {data} = c.getImageData(0.58 * width, 0, 0.34 * width, height);
    const near = ([r, g, b]) => {
      let count = 0;
      for (let i = 0; i < data.length; i += 4)
        count += Math.abs(data[i] - r) + Math.abs(data[i + 1] - g) + Math.abs(data[i + 2] - b) < 60;
      return count;
    };
    return [near([0, 114, 178]), near([0, 158, 115])];
  });
  for (const count of seen) assert.ok(count > 60, `${seen} pixels of lqg and of pid`);
  await close();
});

test('what a trial says of itself is words', async () => {
  const {page, close} = await open('batch', 1440);
  const reasons = await page.evaluate(() => {
    const {table} = globalThis.turbidock;
    const {value} = table.columns.find(column => column.key === 'reason');
    return table.found.map(value);
  });
  assert.ok(reasons.some(reason => /visual servoing/.test(reason)));
  for (const reason of reasons) assert.doesNotMatch(reason, /_/);
  await close();
  const still = await open('still', 1440);
  const empty = await still.page
    .locator('.facts dd')
    .evaluateAll(list => list.filter(value => !value.innerText.trim()).length);
  assert.equal(empty, 0, 'what has no value has a dash');
  await still.close();
});

test('a collision is told without names of shapes', async () => {
  const {page, close} = await open('compare', 1440);
  const told = await page.evaluate(() => JSON.stringify(globalThis.turbidock.model.links));
  assert.match(told, /hull_box/);
  await page
    .getByRole('button', {name: /^\d{10,}$/})
    .first()
    .dispatchEvent('click');
  await page.waitForSelector('#linked .traces canvas');
  const text = await page.locator('#linked').innerText();
  assert.match(text, /hull/);
  assert.doesNotMatch(text, /hull_box/);
  await close();
});

test('on paper: light charts drawn for its width, every column', async () => {
  for (const name of ['batch', 'compare', 'lost', 'steps']) {
    const {page, close} = await open(name, 1440, {colorScheme: 'dark'});
    // what a printer gets is what is drawn before the event's listeners return
    const charts = await page.evaluate(() => {
      dispatchEvent(new Event('beforeprint'));
      return [...document.querySelectorAll('.plot canvas')].map(canvas => {
        const {data} = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
        let dark = 0;
        for (let i = 0; i < data.length; i += 4) dark += data[i + 3] > 128 && data[i] < 128;
        return {width: canvas.width, dark};
      });
    });
    for (const chart of charts) assert.equal(chart.width, 3 * 690);
    assert.ok(
      charts.filter(({dark}) => dark > 100).length >= charts.length - 1,
      'with dark letters',
    );
    await page.emulateMedia({media: 'print', colorScheme: 'dark'});
    await page.setViewportSize({width: 718, height: 1000});
    assert.ok((await page.evaluate(() => document.documentElement.scrollWidth)) <= 718);
    const cut = await page
      .locator('.scroll')
      .evaluateAll(
        list => list.filter(({scrollWidth, clientWidth}) => scrollWidth > clientWidth).length,
      );
    assert.equal(cut, 0, 'no table is cut');
    const broken = await page.locator('.plain td').evaluateAll(cells =>
      cells
        .map(cell => cell.firstChild)
        .filter(text => text?.nodeType === 3 && /^[a-z]+$/.test(text.data))
        .filter(text => {
          const range = document.createRange();
          range.selectNodeContents(text);
          return range.getClientRects().length > 1;
        })
        .map(text => text.data),
    );
    assert.deepEqual(broken, [], 'no word is broken');
    if (name === 'batch') {
      const heads = await page.locator('.scroll thead th').allInnerTexts();
      const columns = await page.evaluate(() =>
        globalThis.turbidock.table.columns.map(c => c.label),
      );
      for (const column of columns) assert.ok(heads.includes(column), column);
      const rows = await page
        .locator('#trials table')
        .evaluateAll(tables => tables.map(table => table.rows.length - 1));
      assert.ok(Math.max(...rows) <= 12, `nobody reads ${rows} rows on paper`);
      assert.match(await page.locator('#trials').innerText(), /The first 12 of 54 rows\./);
    }
    await page.evaluate(() => dispatchEvent(new Event('afterprint')));
    const pdf = await page.pdf({format: 'A4'});
    assert.ok(pdf.length > 20000, 'it prints');
    const pages = pdf.toString('latin1').match(/\/Type \/Page\b/g).length;
    assert.ok(pages <= 6, `${name}: ${pages} pages`);
    await close();
  }
});

test('3D is dark at night, and light on paper', async () => {
  const {page, close} = await open('lost', 1440);
  await sceneDrawn(page);
  const brightness = (name, isPrinted) =>
    page.evaluate(
      ([selector, event]) => {
        if (event) dispatchEvent(new Event(event));
        const canvas = document.querySelector(selector);
        const copy = Object.assign(document.createElement('canvas'), {width: 40, height: 20});
        const c = copy.getContext('2d');
        c.drawImage(canvas, 0, 0, 40, 20);
        const {data} = c.getImageData(0, 0, 40, 20);
        return data.reduce((sum, value, i) => sum + (i % 4 === 3 ? 0 : value), 0) / (3 * 800);
      },
      [name, isPrinted],
    );
  assert.ok((await brightness('.scene', '')) < 60, 'night');
  assert.ok((await brightness('.paper', 'beforeprint')) > 150, 'paper');
  await page.emulateMedia({media: 'print'});
  assert.ok(await page.locator('.paper').isVisible());
  assert.ok(!(await page.locator('.scene').isVisible()), 'which prints black');
  await close();
});

test('no key is a title, a label or a name of a curve', async () => {
  for (const name of ['compare', 'tuning', 'steps', 'vehicle']) {
    const {page, close} = await open(name, 1440);
    assert.doesNotMatch(await page.locator('main').innerText(), /\d °/, `${name}: 5°, not 5 °`);
    const said = await page
      .locator('nav .kind, h2, th[scope=col], .facts dd, .chip')
      .allInnerTexts();
    const axes = await page.evaluate(() =>
      globalThis.turbidock.plots.flatMap(({panel}) => [panel.title, panel.x.label, panel.y.label]),
    );
    for (const text of [...said, ...axes])
      assert.doesNotMatch(
        text.replace(/surge_\w+/, ''),
        /[a-z]\w*_[a-z]|\w\.\w+\.\w/,
        `${name}: ${text}`,
      );
    if (name === 'compare')
      assert.match(
        await page.locator('tr', {hasText: 'lost'}).first().innerText(),
        /current surface velocity y 0\.?\d* m\/s, start heading [\d.]+°/,
      );
    await close();
  }
});

test('what stands at an axis has room: names, ticks and a label', async () => {
  for (const name of ['compare', 'steps']) {
    const {page, close} = await open(name, 390);
    const rooms = await page.evaluate(() =>
      globalThis.turbidock.plots
        .filter(({panel}) => panel.x.label)
        .map(({canvas, box}) => canvas.clientHeight - box.bottom),
    );
    assert.ok(rooms.length > 0);
    for (const room of rooms) assert.ok(room >= 36, `${name}: ${room} pixels`);
    await close();
  }
});

test('recognition: the images, and the limits by name', async () => {
  const {page, complaints, close} = await open('recognition', 1440);
  const widths = await page
    .locator('section[aria-label^="What the cameras saw"] img')
    .evaluateAll(list => list.map(image => image.naturalWidth));
  assert.equal(widths.length, 2);
  assert.ok(Math.min(...widths) > 1000, `${widths}`);
  const narrow = await open('recognition', 390);
  const drawn = await narrow.page
    .locator('section[aria-label^="What the cameras saw"] img')
    .evaluateAll(list => list.map(image => image.clientWidth));
  assert.ok(Math.min(...drawn) > 700, `large enough to see something: ${drawn}`);
  await narrow.close();
  const named = await page.evaluate(() => globalThis.turbidock.plots[0].namedRules().length);
  assert.equal(named, 2, '0.60 and 0.22, beside a legend, too');
  assert.deepEqual(complaints, []);
  await close();
});

test('the hull has its shape', async () => {
  for (const width of [1440, 390]) {
    const {page, close} = await open('vehicle', width);
    const {x, y, seen} = await page.evaluate(() => {
      const {X, Y, panel} = globalThis.turbidock.plots[0];
      const xs = panel.series.flatMap(series => series.x);
      return {
        x: X.of(1) - X.of(0),
        y: Y.of(0) - Y.of(1),
        seen: X.low <= Math.min(...xs) && X.high >= Math.max(...xs),
      };
    });
    assert.ok(Math.abs(x - y) < 0.01 * x, `${x} and ${y} pixels a m`);
    assert.ok(seen, 'all of it');
    await close();
  }
});

test('dark, light and forced colours', async () => {
  const {page, close} = await open('batch', 1440);
  const ground = () => page.evaluate(() => getComputedStyle(document.body).backgroundColor);
  const light = await ground();
  await page.emulateMedia({colorScheme: 'dark'});
  await page.waitForFunction(() => document.documentElement.dataset.theme === 'dark');
  assert.notEqual(await ground(), light);
  const swatches = () =>
    page.locator('.swatch').evaluateAll(list => list.map(s => getComputedStyle(s).backgroundColor));
  await page.emulateMedia({colorScheme: 'light', forcedColors: 'active'});
  const colors = await swatches();
  assert.ok(new Set(colors).size >= 3, `the legend has its colours: ${colors}`);
  await close();
});
