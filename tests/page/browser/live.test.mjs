// `turbidock view` in a real Chromium, at 1440 and 390 pixels: frames arrive, what is drawn is drawn, what can
// be done with a running trial is done, and a batch is watched while it runs.
//
//   PROGRAM=../../../build/bin/turbidock node --test live.test.mjs

import assert from 'node:assert/strict';
import {spawn} from 'node:child_process';
import {mkdtempSync, readFileSync, rmSync, writeFileSync} from 'node:fs';
import http from 'node:http';
import {createRequire} from 'node:module';
import os from 'node:os';
import path from 'node:path';
import {after, afterEach, before, test} from 'node:test';
import {chromium} from 'playwright-core';

const program = path.resolve(process.env.PROGRAM || '../../../build/bin/turbidock');
const axe = readFileSync(createRequire(import.meta.url).resolve('axe-core/axe.min.js'), 'utf8');
const kLong_ms = 90000; // a browser without a GPU on a busy machine

let browser;
let folder;
before(async () => {
  folder = mkdtempSync(path.join(os.tmpdir(), 'turbidock-live-'));
  browser = await chromium.launch({
    executablePath: process.env.CHROMIUM || '/usr/bin/chromium',
    args: ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'],
  });
});
after(async () => {
  await browser?.close();
  rmSync(folder, {recursive: true, force: true});
});

// What a test leaves running when it fails would disturb the next.
const running = [];
afterEach(async () => {
  for (const end of running.splice(0)) await end();
});

// A trial that goes on however long a busy machine takes: the vehicle waits in front of the marker.
const kWaiting = [
  'pool_active',
  ...[
    'duration_s=600',
    'procedure.found_hold_s=600',
    'procedure.search_yaw_v=0',
    'docked_hold_s=60',
  ].flatMap(assignment => ['--set', assignment]),
];

/**
 * Starts the program; {url, said(): what it said, stop(): ends it by Ctrl-C and gives what ended it, which a shell
 * calls 130}.
 */
async function view(...words) {
  const child = spawn(
    program,
    ['view', ...words, ...(words.includes('--port') ? [] : ['--port', '0'])],
    {cwd: folder, stdio: ['ignore', 'pipe', 'pipe']},
  );
  let said = '';
  running.push(() => child.kill('SIGKILL'));
  child.stderr.on('data', data => {
    said += data;
  });
  const ended = new Promise(resolve =>
    child.on('close', (code, signal) => resolve(code ?? signal)),
  );
  const url = await new Promise((resolve, reject) => {
    child.stdout.on('data', data => resolve(String(data).trim()));
    ended.then(code => reject(new Error(`ended with ${code}: ${said}`)));
  });
  return {
    url,
    said: () => said,
    ended,
    stop: () => {
      child.kill('SIGINT');
      return ended;
    },
  };
}

/** Opens the address; collects what the page complains about and asks for. */
async function open(url, width = 1440) {
  const context = await browser.newContext({
    viewport: {width, height: width > 600 ? 900 : 844},
    colorScheme: 'light',
  });
  running.unshift(() => context.close());
  context.setDefaultTimeout(kLong_ms);
  const page = await context.newPage();
  const complaints = [];
  const requests = [];
  page.on('console', message => {
    if (['error', 'warning'].includes(message.type())) complaints.push(message.text());
  });
  page.on('pageerror', error => complaints.push(error.message));
  page.on('request', request => {
    if (!/^(data|blob):/.test(request.url()) && request.url() !== url) requests.push(request.url());
  });
  await page.goto(url);
  return {page, complaints, requests, close: () => context.close()};
}

/**
 * Waits until f(argument) holds in the page. Not waitForFunction(): it evaluates text in the page, which the page
 * forbids.
 */
async function until(page, f, argument, timeout_ms = kLong_ms) {
  const holds = () =>
    page.evaluate(f, argument).catch(error => {
      if (!/context was destroyed/.test(error.message)) throw error;
      return false; // the page loads itself anew
    });
  for (const end = performance.now() + timeout_ms; !(await holds());) {
    assert.ok(performance.now() < end, `not within ${timeout_ms / 1000} s: ${f}`);
    await new Promise(resolve => setTimeout(resolve, 100));
  }
}

// What was changed while the trial ran.
const kChanges = 'section[aria-label="Changed while it ran"] tbody tr';

const pictures = page =>
  page.evaluate(() => Number(document.documentElement.dataset.pictures || 0));
const morePictures = (page, than) =>
  until(page, n => Number(document.documentElement.dataset.pictures || 0) > n, than);
const state = (page, word) =>
  until(page, w => document.querySelector('.head .badge')?.textContent.includes(w), word);
/** How many frames the program has simulated, and how many of their rows are here. */
const frames = page =>
  page.evaluate(() => {
    const {status, trialView} = globalThis.turbidock;
    return {simulated: status.frames, rows: trialView.series.length};
  });
/** Waits until the program stands still and all of it is here. Single frames always come with their picture. */
const standsStill = page =>
  until(page, () => {
    const {status, trialView} = globalThis.turbidock;
    return !status.going && trialView.series.length === status.frames;
  });

// Not click(): without a GPU, on a busy machine, a page that always moves is never still enough for it.
const press = locator => locator.dispatchEvent('click');

/** How many colours each canvas shows that a selector names. */
const colours = (page, selector) =>
  page.evaluate(
    s =>
      [...document.querySelectorAll(s)].map(canvas => {
        const copy = Object.assign(document.createElement('canvas'), {
          width: canvas.width,
          height: canvas.height,
        });
        const c = copy.getContext('2d');
        c.drawImage(canvas, 0, 0);
        const {data} = c.getImageData(0, 0, copy.width, copy.height);
        const seen = new Set();
        for (let i = 0; i < data.length; i += 4)
          seen.add(((data[i] >> 4) << 8) | ((data[i + 1] >> 4) << 4) | (data[i + 2] >> 4));
        return seen.size;
      }),
    selector,
  );

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
    /one could see 3\.7 m/.test(document.querySelector('.scene-key').textContent),
  );
  await press(page.locator('.knob', {hasText: 'lamps'}).locator('input[type=checkbox]'));
  await page.locator('.knob', {hasText: 'controller'}).locator('select').selectOption('p_voltage');
  await until(page, () =>
    [...document.querySelectorAll('.knob')].some(k => k.title === 'p_voltage.sway.kp_v_per_m'),
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
  for (const key of ['water.milk_ml_m3', 'lamps.enabled', 'controller', 'push'])
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
      ['lamps.enabled', 'true'],
      ['controller', 'p_voltage'],
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
  const served = await view('pool_active', '--set', 'duration_s=10');
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

test('a batch while it runs', async () => {
  writeFileSync(
    path.join(folder, 'plan.yaml'),
    `schema_version: 1
description: 'a <b id="injected">batch</b>'
scenario: sea_night_active
seeds: 100
set: {pose_source: true_pose, duration_s: 30}
grid: {controller: [pid, lqg]}
`,
  );
  const batch = spawn(
    program,
    ['batch', 'plan.yaml', '--out', 'sweep.db', '--workers', '1', '--quiet'],
    {cwd: folder, stdio: 'ignore'},
  );
  running.push(() => batch.kill('SIGKILL'));
  const ended = new Promise(resolve => batch.on('exit', resolve));
  const there = () => {
    try {
      return readFileSync(path.join(folder, 'sweep.db')).length > 0;
    } catch {
      return false;
    }
  };
  while (!there()) await new Promise(resolve => setTimeout(resolve, 50));
  await new Promise(resolve => setTimeout(resolve, 1000));
  const served = await view('sweep.db');
  const {page, complaints, close} = await open(served.url);
  await page.waitForSelector('html[data-ready=true]', {timeout: kLong_ms});
  const status = page.locator('#trials [role=status]');
  const first = Number.parseInt(await status.innerText(), 10);
  assert.ok(first < 200, `${first} of 200 trials at first`);
  assert.match(await page.locator('.badge').first().innerText(), /running/);
  // the page loads itself again, until all are there
  const listed = n =>
    Number.parseInt(document.querySelector('#trials [role=status]')?.textContent, 10) >= n;
  await until(page, listed, first + 1);
  await until(page, listed, 200, 2 * kLong_ms);
  await until(page, () => document.querySelector('.badge')?.textContent.includes('succeed'));
  assert.equal(await page.locator('#injected').count(), 0, 'HTML in a name is text');
  assert.deepEqual(complaints, []);
  await close();
  assert.equal(await ended, 0);
  assert.equal(await served.stop(), 130);
});

test('a tuning study while it runs, then its report', async () => {
  writeFileSync(
    path.join(folder, 'study.yaml'),
    `schema_version: 1
description: 'sway <b id="injected">tried</b>'
scenario: sea_night_active
seeds: 6
set: {pose_source: true_pose, controller: lqg, duration_s: 30}
tuning:
  gains:
    - {key: lqg.sway.effort_share, low: 0.09, high: 1.4, scale: log}
  objective:
    - {metric: time_s, weight: 1, failed: 60}
  optimiser: {population: 5, generations: 3}
  proof: {held_out_seeds: 8, cameras: false}
`,
  );
  const tune = spawn(
    program,
    ['tune', 'study.yaml', '--out', 'study', '--workers', '1', '--quiet'],
    {cwd: folder, stdio: 'ignore'},
  );
  running.push(() => tune.kill('SIGKILL'));
  const ended = new Promise(resolve => tune.on('exit', resolve));
  const there = () => {
    try {
      return readFileSync(path.join(folder, 'study/evaluations.sqlite')).length > 0;
    } catch {
      return false;
    }
  };
  while (!there()) await new Promise(resolve => setTimeout(resolve, 50));
  await new Promise(resolve => setTimeout(resolve, 1500));
  const served = await view('study');
  const {page, complaints, close} = await open(served.url);
  await until(page, () => document.querySelector('nav .kind')?.textContent === 'tuning');
  await until(page, () => document.querySelector('section[aria-label="Convergence"] canvas'));
  let cost = [0];
  for (let look = 0; look < 30 && cost[0] < 4; ++look) {
    await page.waitForTimeout(300);
    cost = await colours(page, 'section[aria-label="Convergence"] canvas');
  }
  assert.ok(!(cost[0] < 4), `its convergence shows ${cost} colours`);
  assert.equal(await ended, 0);
  // the same page becomes the report
  await until(
    page,
    () => document.querySelector('section[aria-label="Before and after, on held-out seeds"]'),
    null,
    2 * kLong_ms,
  );
  assert.equal(await page.locator('#injected').count(), 0, 'HTML in a name is text');
  assert.deepEqual(complaints, []);
  await close();
  assert.equal(await served.stop(), 130);
});

test('nothing gets in, and the trial goes on', async () => {
  const served = await view(...kWaiting);
  const url = new URL(served.url);
  const {page, complaints, close} = await open(served.url);
  await morePictures(page, 2);
  /** The answer's status; 0 for a connection that was closed without one. */
  const ask = (options, body) =>
    new Promise(resolve => {
      const request = http.request(
        {host: url.hostname, port: url.port, path: url.pathname, agent: false, ...options},
        answer => {
          answer.resume();
          resolve(answer.statusCode);
        },
      );
      request.on('error', () => resolve(0));
      if (body) for (let sent = 0; sent < body.times; ++sent) request.write(body.block);
      request.end();
    });
  assert.equal(await ask({}), 200);
  const own = `http://${url.host}`;
  const evil = 'http://evil.example';
  for (const [what, options, status] of [
    ['a foreign host', {headers: {host: 'evil.example'}}, 403],
    ['a foreign origin', {headers: {origin: evil}}, 403],
    ['no secret', {path: '/'}, 404],
    ['another secret', {path: `/${'0'.repeat(32)}/`}, 404],
    ['a file', {path: `${url.pathname}../../etc/passwd`}, 404],
    ['a file, encoded', {path: `${url.pathname}%2e%2e/%2e%2e/etc/passwd`}, 404],
    [
      'a socket of another page',
      {
        path: `${url.pathname}live`,
        headers: {
          origin: evil,
          connection: 'Upgrade',
          upgrade: 'websocket',
          'sec-websocket-version': 13,
          'sec-websocket-key': 'dGhlIHNhbXBsZSBub25jZQ==',
        },
      },
      403,
    ],
    ['a post', {method: 'POST', headers: {origin: own}}, 405],
  ])
    assert.equal(await ask(options), status, what);
  const refused = await ask(
    {method: 'POST', headers: {'content-length': 1e8}},
    {block: Buffer.alloc(1e6), times: 100},
  );
  assert.ok([413, 0].includes(refused), `a body of 100 MB: ${refused}`);
  const crowd = await Promise.all(Array.from({length: 1000}, () => ask({})));
  assert.ok(
    crowd.every(status => [200, 503, 0].includes(status)),
    `1,000 at once: ${[...new Set(crowd)]}`,
  );
  // those that wait have a few seconds
  for (const end = performance.now() + 20000; (await ask({})) !== 200;) {
    assert.ok(performance.now() < end, 'and then the page again');
    await page.waitForTimeout(200);
  }
  await morePictures(page, (await pictures(page)) + 3);
  assert.deepEqual(complaints, []);
  await close();
  assert.equal(await served.stop(), 130);
});

test('bad input is one line', async () => {
  const fails = async (words, pattern) => {
    await assert.rejects(view(...words), error => {
      assert.match(error.message, pattern);
      assert.match(error.message, /^ended with 2: /);
      assert.equal(error.message.trim().split('\n').length, 1);
      return true;
    });
  };
  await fails(['nowhere.yaml'], /nowhere\.yaml/);
  await fails(['nowhere.db'], /nowhere\.db/);
  writeFileSync(path.join(folder, 'empty.db'), '');
  await fails(['empty.db'], /empty\.db/);
  await fails([folder], /result\.json|no trial/);
  writeFileSync(path.join(folder, 'torn.db'), 'SQLite format 3\0' + 'x'.repeat(5000));
  await fails(['torn.db'], /torn\.db/);
  writeFileSync(path.join(folder, 'other.json'), '{"a": 1}');
  await fails(['other.json'], /other\.json: is no result/);
  await fails(['sea_night_active', '--quiet', '--listen', 'nowhere'], /no address/);
  const other = await view(...kWaiting);
  const {port} = new URL(other.url);
  await fails(
    ['sea_night_active', '--quiet', '--port', port],
    new RegExp(`${port} is in use; give another --port`),
  );
  assert.equal(await other.stop(), 130);
});
