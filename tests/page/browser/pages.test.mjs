// Every kind of report in a real Chromium, at 1440 and 390 pixels: no error, no request, what is drawn is
// drawn, what can be clicked works, and axe finds nothing serious.
//
//   bash make_reports.sh ../../../build/bin/turbidock FOLDER && REPORTS=FOLDER node --test .

import assert from 'node:assert/strict';
import {readFileSync, statSync} from 'node:fs';
import {createRequire} from 'node:module';
import path from 'node:path';
import {test} from 'node:test';
import {drawn, folder, isDrawn, open, sceneDrawn} from './opened.mjs';

const axe = readFileSync(createRequire(import.meta.url).resolve('axe-core/axe.min.js'), 'utf8');
const kWidths = [1440, 390];
const kKinds = {
  trial: {plots: 9, scene: true, video: true},
  still: {plots: 9, scene: true},
  lost: {plots: 9, scene: true},
  batch: {plots: 3},
  none: {plots: 2},
  single: {plots: 2},
  compare: {plots: 1},
  tuning: {plots: 3},
  steps: {plots: 16},
  vehicle: {plots: 3},
  gate: {plots: 1},
  recognition: {plots: 2},
  estimate: {plots: 4, images: 1},
};

for (const [name, expected] of Object.entries(kKinds))
  for (const width of kWidths)
    test(`${name} at ${width} px`, async () => {
      const {page, complaints, requests, close} = await open(name, width);
      if (expected.scene) await sceneDrawn(page);
      let plots = [];
      for (let look = 0; look < 20; ++look) {
        // a slow machine draws late
        plots = (await drawn(page)).filter(canvas => canvas.plot);
        if (plots.length >= expected.plots && plots.every(isDrawn)) break;
        await page.waitForTimeout(500);
      }
      assert.ok(
        plots.length >= expected.plots,
        `${plots.length} plots, at least ${expected.plots}`,
      );
      for (const plot of plots)
        assert.ok(isDrawn(plot), `${plot.label} is drawn: ${JSON.stringify(plot)}`);
      assert.ok(
        (await page.evaluate(() => document.documentElement.scrollWidth)) <= width,
        'nothing sticks out to the side',
      );
      assert.equal(await page.locator('#injected').count(), 0, 'HTML in a name is text');
      assert.equal(await page.locator('h1').count(), 1);
      if (expected.images) assert.equal(await page.locator('img').count(), expected.images);
      await page.evaluate(axe);
      for (const scheme of ['light', 'dark']) {
        await page.emulateMedia({colorScheme: scheme});
        const {violations} = await page.evaluate(() =>
          globalThis.axe.run(document, {resultTypes: ['violations']}),
        );
        const serious = violations.filter(v => ['serious', 'critical'].includes(v.impact));
        assert.deepEqual(
          serious.map(
            v =>
              `${v.id}: ${v.nodes
                .slice(0, 3)
                .map(n => n.html.slice(0, 120))
                .join(' | ')}`,
          ),
          [],
          `axe, ${scheme}`,
        );
      }
      assert.deepEqual(complaints, []);
      assert.deepEqual(requests, []);
      await close();
    });

test('a trial: text of a name, time by slider, keys and plot, pictures and film', async () => {
  const {page, complaints, close} = await open('trial', 1440);
  assert.match(await page.locator('h1').innerText(), /<b id="injected">short<\/b> trial & more/);
  const now = () => page.locator('.now').innerText();
  await page.locator('.transport input[type=range]').fill('1');
  assert.match(await now(), /^1\.0 s/);
  const plot = page.locator('.traces canvas').nth(2);
  const box = await plot.boundingBox();
  await page.mouse.move(box.x + box.width * 0.6, box.y + box.height / 2);
  assert.doesNotMatch(await now(), /^1\.0 s/, 'the time follows the pointer');
  const before = await drawn(page);
  await page.mouse.move(box.x + box.width * 0.3, box.y + 40);
  await page.mouse.down();
  await page.mouse.move(box.x + box.width * 0.5, box.y + 40);
  await page.mouse.up();
  await page.waitForTimeout(200);
  assert.notDeepEqual(
    (await drawn(page)).filter(c => c.plot),
    before.filter(c => c.plot),
    'a drag zooms all plots',
  );
  const stage = page.locator('section[aria-label="Stages"] button.link').first();
  await stage.click();
  const [time, row] = await page.evaluate(() => {
    const {clock, series} = globalThis.turbidock;
    return [clock.time, series.indexAt(clock.time)];
  });
  assert.equal(time.toFixed(1), await stage.innerText());
  assert.equal(row, Math.round(30 * time), 'the row of that frame');
  const chip = page.locator('.traces .chip').first();
  await chip.click();
  assert.equal(await chip.getAttribute('aria-pressed'), 'false');
  await page.locator('.transport input[type=range]').fill('0');
  assert.equal(
    await page.locator('video').count(),
    0,
    'the film is not loaded before it is played',
  );
  await page.locator('.play').click();
  await page.waitForFunction(() => document.querySelector('video')?.currentTime > 0.2);
  const frame = await page.evaluate(async () => {
    const video = document.querySelector('video');
    // The clock runs before the first image is decoded on a slow machine.
    await new Promise(resolve => video.requestVideoFrameCallback(resolve));
    const c = Object.assign(document.createElement('canvas'), {width: 64, height: 36}).getContext(
      '2d',
    );
    c.drawImage(video, 0, 0, 64, 36);
    return Math.max(...c.getImageData(0, 0, 64, 24).data.filter((_, i) => i % 4 !== 3));
  });
  assert.ok(frame > 60, 'and shows something');
  assert.deepEqual(complaints, []);
  await close();
});

test('a clock that is started again within a frame runs once', async () => {
  const source = readFileSync(
    new URL('../../../experiments/page/web/clock.js', import.meta.url),
    'base64',
  );
  const {Clock} = await import(`data:text/javascript;base64,${source}`);
  const due = new Map();
  let last = 0;
  globalThis.requestAnimationFrame = draw => {
    due.set(++last, draw);
    return last;
  };
  globalThis.cancelAnimationFrame = number => due.delete(number);
  const clock = new Clock({end: 100});
  clock.play();
  clock.pause();
  clock.play();
  const in10s = performance.now() + 10000;
  for (const draw of [...due.values()]) draw(in10s);
  assert.ok(Math.abs(clock.time - 10) < 1, `${clock.time} s have passed`);
});

test('a batch: filter, sort, a point lists its trials, a trial shows its traces and command', async () => {
  const {page, complaints, close} = await open('batch', 1440);
  const rows = page.locator('.rows .row');
  const status = page.locator('#trials [role=status]');
  assert.match(await status.innerText(), /^54 trials/);
  await page.getByLabel('filter failure').selectOption('none');
  assert.match(await status.innerText(), /^\d+ of 54 trials/);
  for (const text of await rows.locator('.cell:nth-child(3)').allInnerTexts())
    assert.equal(text, 'none');
  await page.getByRole('button', {name: 'Clear filters'}).click();
  await page.getByLabel('filter time, s').fill('< 0');
  assert.match(await status.innerText(), /^0 of 54/);
  await page.getByLabel('filter time, s').fill('');
  const without = await page.evaluate(() => {
    const {table} = globalThis.turbidock;
    const nothing = (column, i) => (column.value(i) ?? null) === null;
    const column = table.columns.find(c => c.isNumeric && table.found.some(i => nothing(c, i)));
    table.filter(column.key, '> -999999');
    const count = table.found.filter(i => nothing(column, i)).length;
    table.filter(column.key, '');
    return count;
  });
  assert.equal(without, 0, 'a row without a value is in no range');
  await page.getByRole('button', {name: 'trial', exact: true}).click();
  await page.getByRole('button', {name: 'trial', exact: true}).click();
  assert.equal(await rows.first().locator('.cell').first().innerText(), '53');
  const success = page.locator('section[aria-label="Success by anything"] canvas');
  await success.focus();
  await page.keyboard.press('ArrowRight');
  await page.keyboard.press('Enter');
  assert.match(await status.innerText(), /^6 of 54 trials: current surface velocity y, m\/s 0/);
  await rows.first().click();
  await page.waitForSelector('#trial .traces canvas');
  assert.match(
    await page.locator('#trial code').first().innerText(),
    /^turbidock replay .*batch\.db \d+ --out/,
  );
  await sceneDrawn(page);
  const traces = (await drawn(page)).filter(c => c.label?.includes('over time'));
  assert.ok(traces.length >= 8 && traces.every(c => c.other > 0.004), 'its traces are drawn');
  await page.getByRole('button', {name: 'Clear filters'}).click();
  await page.locator('section[aria-label="Failures"] button').first().click();
  assert.match(await status.innerText(), /^\d+ of 54 trials/);
  assert.deepEqual(complaints, []);
  await close();
});

test("a chart's intervals are the program's, over strata", async () => {
  const {groups} = JSON.parse(readFileSync(path.join(folder, 'batch_by_law.json'), 'utf8'));
  assert.equal(groups.length, 3);
  const {page, close} = await open('batch', 1440);
  const charts = await page.evaluate(() => globalThis.turbidock.model.success);
  const {across} = charts.axes.find(({key}) => key === 'control.use');
  const [{low, high}] = charts.panels['control.use|'].series;
  for (const {group, wilson} of groups) {
    const k = across.names.indexOf(group['control.use']);
    assert.ok(Math.abs(low[k] - 100 * wilson[0]) + Math.abs(high[k] - 100 * wilson[1]) < 1e-9);
  }
  await close();
});

test('ten thousand trials: size, time to open, memory, sorting', async () => {
  const bytes = statSync(path.join(folder, 'many.html')).size;
  assert.ok(bytes <= 5e6, `${bytes} bytes`);
  const begin = performance.now();
  const {page, complaints, close} = await open('many', 1440);
  const ready = await page.evaluate(
    () => performance.getEntriesByName('turbidock-ready')[0].startTime,
  );
  const heap = (await (await page.context().newCDPSession(page)).send('Runtime.getHeapUsage'))
    .usedSize;
  console.log(
    `10,000 trials: ${(bytes / 1e6).toFixed(1)} MB, ready after ${ready.toFixed(0)} ms, ` +
      `heap ${(heap / 1e6).toFixed(0)} MB, ` +
      `looked through in ${(performance.now() - begin).toFixed(0)} ms`,
  );
  assert.ok(ready < 10000, `ready after ${ready} ms: five times what it takes on a quiet machine`);
  assert.ok(heap < 200e6, `${heap} bytes`);
  const rows = page.locator('.rows .row');
  assert.ok((await rows.count()) < 60, 'only rows in view are there');
  await page.getByRole('button', {name: 'time, s', exact: true}).press('Enter');
  const times = (await rows.locator('.cell:nth-child(8)').allInnerTexts()).map(Number);
  assert.deepEqual(
    times,
    [...times].sort((a, b) => a - b),
  );
  await page.locator('.table-scroll').evaluate(element => {
    element.scrollTop = element.scrollHeight;
  });
  await page.waitForFunction(() =>
    [...document.querySelectorAll('.rows .row')].some(
      row => row.getAttribute('aria-rowindex') === '10001',
    ),
  );
  assert.deepEqual(complaints, []);
  await close();
});

test('a comparison: a seed that flipped is shown on both sides', async () => {
  const {page, complaints, close} = await open('compare', 1440);
  assert.match(
    await page.locator('.badge').first().innerText(),
    /no significant change in success/,
  );
  await page
    .getByRole('button', {name: /^\d{10,}$/})
    .first()
    .dispatchEvent('click');
  await page.waitForSelector('#linked .traces canvas');
  await page.waitForFunction(() => document.querySelectorAll('#linked .transport').length === 2);
  const commands = await page.locator('#linked code').allInnerTexts();
  assert.match(commands[0], /^turbidock replay a\.db \d+ --out/);
  assert.match(commands[1], /^turbidock replay b\.db \d+ --out/);
  assert.deepEqual(await page.locator('#linked .badge').allInnerTexts(), [
    '✓ success',
    '✕ collision',
  ]);
  let traces = [];
  for (
    let look = 0;
    look < 20 && !(traces.length >= 16 && traces.every(c => c.other > 0.004));
    ++look
  ) {
    await page.waitForTimeout(500);
    traces = (await drawn(page)).filter(c => c.label?.includes('over time'));
  }
  assert.ok(
    traces.length >= 16 && traces.every(c => c.other > 0.004),
    'the traces of both are drawn',
  );
  // one clock for both, and one key
  const times = () =>
    page
      .locator('#linked .transport input[type=range]')
      .evaluateAll(list => list.map(slider => slider.value));
  const [a, b] = await times();
  assert.equal(a, b);
  await page.keyboard.press(' ');
  await page.waitForFunction(
    from => document.querySelector('#linked .transport input').value > Number(from) + 0.1,
    a,
    {timeout: 10000},
  );
  await page.keyboard.press(' ');
  const [after, other] = await times();
  assert.equal(after, other);
  assert.deepEqual(complaints, []);
  await close();
});

test('a gate: a click on a seed that no longer docks shows its trial', async () => {
  const {page, complaints, close} = await open('gate', 1440);
  assert.match(await page.locator('.badge').first().innerText(), /fail/);
  const seeds = page.getByRole('button', {name: /^\d{10,}$/});
  assert.equal(await seeds.count(), 5, 'every seed that changed');
  // the picture leads there
  const picture = page.locator('section[aria-label="What changed"] canvas');
  await picture.press('ArrowRight');
  await picture.press('Enter');
  assert.equal(await page.evaluate(() => document.activeElement.cells[2].textContent), 'short');
  const seed = await seeds.first().innerText();
  await seeds.first().click();
  await page.waitForSelector('#linked .traces canvas');
  assert.match(await page.locator('#linked h2').first().innerText(), new RegExp(`${seed}$`));
  assert.match(await page.locator('#linked code').first().innerText(), /^turbidock run .*resolved/);
  await sceneDrawn(page);
  // one that was not run again says how to
  const last = await seeds.last().innerText();
  await seeds.last().click();
  await page.waitForFunction(
    seed => document.querySelector('#linked h2')?.textContent.endsWith(seed),
    last,
  );
  assert.match(
    await page.locator('#linked code').first().innerText(),
    /^turbidock replay .*trials\.db \d+ --out out\/short_/,
  );
  assert.deepEqual(complaints, []);
  await close();
});
