// `turbidock view` in a real Chromium, at 1440 and 390 pixels: frames arrive, what is drawn is drawn, what can
// be done with a running trial is done.
//
//   PROGRAM=../../../build/bin/turbidock node --test live.test.mjs

import assert from 'node:assert/strict';
import {readFileSync} from 'node:fs';
import path from 'node:path';
import {test} from 'node:test';
import {
  axe,
  colours,
  folder,
  frames,
  kChanges,
  kWaiting,
  morePictures,
  open,
  pictures,
  press,
  running,
  standsStill,
  state,
  until,
  view,
} from './live_view.mjs';

for (const width of [1440, 390])
  test(`a running trial at ${width} px`, async () => {
    const served = await view(...kWaiting);
    const {page, complaints, requests, close} = await open(served.url, width);
    await morePictures(page, 5);
    await until(page, () => document.querySelector('canvas.scene'));
    await page.waitForTimeout(1500);
    for (const [selector, least] of [
      ['.cameras canvas', 20],
      ['canvas.scene', 12],
      ['.traces canvas', 3],
    ])
      for (const count of await colours(page, selector))
        assert.ok(count >= least, `${selector} shows ${count} colours`);
    assert.ok(
      (await page.evaluate(() => document.documentElement.scrollWidth)) <= width,
      'nothing sticks out to the side',
    );
    assert.match(await page.locator('h1').innerText(), /pool/);
    // what shows a slider's effect is in sight with it
    await page.evaluate(() => document.querySelector('.view').scrollIntoView());
    const seen = await page.evaluate(() =>
      ['.cameras', '.knob'].map(what => {
        const {top, bottom} = document.querySelector(what).getBoundingClientRect();
        return top >= 0 && bottom <= innerHeight;
      }),
    );
    assert.deepEqual(seen, [true, true], 'cameras and the first slider');
    await page.evaluate(axe);
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
    );
    assert.deepEqual(complaints, []);
    assert.deepEqual(requests, []);
    await close();
    assert.equal(await served.stop(), 130);
  });

test('pause, step, speed, sliders, push, restart, and what the record says', async () => {
  const served = await view(...kWaiting, '--out', 'live');
  const {page, complaints, close} = await open(served.url);
  await morePictures(page, 3);
  await press(page.locator('.play'));
  await standsStill(page);
  const paused = await frames(page);
  await page.waitForTimeout(700);
  assert.equal((await frames(page)).simulated, paused.simulated, 'the time stands still');
  await press(page.getByRole('button', {name: 'Step'}));
  await until(page, n => globalThis.turbidock.last.frame === n, paused.simulated);
  await standsStill(page);
  assert.equal((await frames(page)).simulated, paused.simulated + 1, 'one frame');
  await until(page, () => document.querySelector('.head .facts').textContent.includes('changes0'));

  const milk = page.locator('.knob', {hasText: 'milk'});
  await milk.locator('input').fill('30');
  assert.equal(await milk.locator('output').innerText(), '30 ml/m³');
  await until(page, () =>
    /one could see 3\.3 m/.test(document.querySelector('.scene-key').textContent),
  );
  await press(page.locator('.knob', {hasText: 'lamps'}).locator('input[type=checkbox]'));
  await page.locator('.knob', {hasText: 'controller'}).locator('select').selectOption('p_voltage');
  await until(page, () =>
    [...document.querySelectorAll('.knob')].some(
      k => k.title === 'control.p_voltage.sway.kp_v_per_m',
    ),
  );
  const labels = await page.locator('.knob > span').evaluateAll(list =>
    list.map(({innerText, scrollWidth, clientWidth}) => ({
      innerText,
      isCut: scrollWidth > clientWidth,
    })),
  );
  for (const {innerText, isCut} of labels) {
    assert.doesNotMatch(innerText, /[_.]/, 'no key is a label');
    assert.ok(!isCut, `${innerText} has room beside its slider`);
  }
  await press(page.getByRole('button', {name: 'left', exact: true}));
  await until(page, rows => document.querySelectorAll(rows).length >= 5, kChanges);
  const changes = await page.locator(kChanges).allInnerTexts();
  for (const key of ['water.milk_ml_m3', 'lights.lamps.enabled', 'control.use', 'push'])
    assert.ok(
      changes.some(row => row.includes(key)),
      `${key} in ${changes}`,
    );

  await page.locator('.transport select').selectOption('0.5');
  await until(page, () => globalThis.turbidock.status.speed === 0.5);
  await press(page.locator('.play'));
  await state(page, 'running');
  await morePictures(page, await pictures(page));
  // a second tab, and the first one loaded again
  const other = await open(served.url, 390);
  await morePictures(other.page, 0);
  await page.reload();
  await morePictures(page, 0);
  assert.equal(
    await page.locator('.knob', {hasText: 'milk'}).locator('output').innerText(),
    '30 ml/m³',
  );
  await page.locator('.restart input').fill('12345678901234567');
  await press(page.getByRole('button', {name: 'Restart'}));
  await until(page, () => document.title.endsWith('12345678901234567'));
  await morePictures(page, (await pictures(page)) + 2);
  // a new trial begins with them
  await until(page, () =>
    [...document.querySelectorAll('.head .facts div')].some(div => div.textContent === 'changes0'),
  );
  const result = JSON.parse(readFileSync(path.join(folder, 'live/result.json')));
  assert.equal(result.outcome, 'interrupted');
  assert.deepEqual(
    result.changes.slice(0, 3).map(c => [c.key, c.value]),
    [
      ['water.milk_ml_m3', '30'],
      ['lights.lamps.enabled', 'true'],
      ['control.use', 'p_voltage'],
    ],
  );
  assert.deepEqual([...complaints, ...other.complaints], []);
  await other.close();
  await press(page.getByRole('button', {name: 'right', exact: true}));
  await until(page, rows => document.querySelectorAll(rows).length >= 1, kChanges);
  assert.equal(await served.stop(), 130);
  // cut off by Ctrl-C, it has its record, too
  const last = JSON.parse(readFileSync(path.join(folder, 'live/result.json')));
  assert.equal(last.outcome, 'interrupted');
  assert.equal(String(last.changes[0].key), 'push');
  assert.match(served.said(), /interrupted: .*, digest [0-9a-f]+, \d+ settings changed/);
  await until(page, () =>
    document.querySelector('[role=alert]:not([hidden])')?.textContent.includes('has ended'),
  );
  await close();
});

test('a page that opens before the first frame has all its controls', async () => {
  const served = await view(...kWaiting);
  const {page, complaints, close} = await open(served.url);
  await morePictures(page, 0);
  await press(page.locator('.play'));
  await standsStill(page);
  await press(page.getByRole('button', {name: 'Next seed'}));
  await until(page, () => globalThis.turbidock.status.frames === 0);
  const other = await open(served.url, 390);
  await page.reload();
  for (const one of [page, other.page]) {
    await until(one, () => document.querySelector('.knobs fieldset'));
    await until(one, () => document.querySelector('[aria-label="push the vehicle"]'));
    assert.equal(await one.locator('.traces canvas').count(), 9);
  }
  await press(other.page.getByRole('button', {name: 'Step'}));
  for (const one of [page, other.page]) {
    await morePictures(one, 0);
    assert.equal((await frames(one)).rows, 1);
  }
  await press(page.locator('.play'));
  await until(page, () => globalThis.turbidock.trialView.series.length > 5);
  assert.deepEqual([...complaints, ...other.complaints], []);
  await other.close();
  await close();
  assert.equal(await served.stop(), 130);
});

test('a trial that has ended is shown again, and takes no hands', async () => {
  const served = await view('pool_active', '--set', 'trial.duration_s=10');
  const {page, complaints, close} = await open(served.url);
  await until(page, () => globalThis.turbidock?.status.ended);
  await until(page, () => document.querySelector('[aria-label="push the vehicle"]'));
  const hands = page.locator('[aria-label="push the vehicle"] button, .transport button', {
    hasText: /^(ahead|up|Step)$/,
  });
  for (const one of await hands.all()) assert.ok(await one.isDisabled());
  assert.equal(await hands.count(), 3);
  for (const said of [
    await page.locator('[aria-label="push the vehicle"] .note').innerText(),
    await page.getByRole('button', {name: 'Step'}).getAttribute('title'),
  ])
    assert.match(said, /has ended/);
  // what is not on the page is refused, too
  await page.evaluate(() => globalThis.turbidock.program.send({do: 'step'}));
  await until(page, () =>
    document.querySelector('[role=alert]:not([hidden])')?.textContent.includes('has ended'),
  );
  const shown = () =>
    page.evaluate(() => {
      const {clock, trialView: view} = globalThis.turbidock;
      return {
        time: clock.time,
        cursor: view.sync.cursor,
        now: view.now.textContent,
        caption: view.cameras.caption.textContent,
      };
    });
  const last = await shown();
  await press(page.locator('.play'));
  await until(page, () => {
    const {time} = globalThis.turbidock.clock;
    return time > 0.5 && time < 9; // a busy machine looks seldom
  });
  const during = await shown(); // while it plays
  await press(page.locator('.play'));
  assert.ok(during.time > 0 && during.time < last.time, `${during.time} of ${last.time} s`);
  assert.equal(during.cursor, during.time, 'the cursor');
  assert.notEqual(during.now, last.now, 'the values');
  await until(
    page,
    caption => {
      const {cameras} = globalThis.turbidock.trialView;
      return cameras.caption.textContent !== caption;
    },
    last.caption,
  );
  await press(page.getByRole('button', {name: 'Now'}));
  await until(
    page,
    caption => {
      const {cameras} = globalThis.turbidock.trialView;
      return cameras.caption.textContent === caption;
    },
    last.caption,
  );
  // another trial: hands on again
  await press(page.getByRole('button', {name: 'Restart'}));
  await until(page, () => !globalThis.turbidock.status.ended);
  for (const one of await hands.all()) assert.ok(await one.isEnabled());
  assert.deepEqual(complaints, []);
  await close();
  assert.equal(await served.stop(), 130);
});

test('the vehicle is pushed, and let go', async () => {
  const served = await view(...kWaiting);
  const {page, complaints, close} = await open(served.url);
  await morePictures(page, 3);
  await press(page.locator('[aria-label="push the vehicle"] button', {hasText: 'left'}));
  // the last first: let go at the end
  await until(
    page,
    rows => document.querySelector(rows)?.textContent.endsWith('push[0, 0, 0] N'),
    kChanges,
  );
  const pushes = await page.locator(kChanges, {hasText: 'push'}).allInnerTexts();
  assert.equal(pushes.length, 2);
  assert.doesNotMatch(pushes[1], /\[0, 0, 0\]/);
  assert.deepEqual(complaints, []);
  await close();
  assert.equal(await served.stop(), 130);
});
