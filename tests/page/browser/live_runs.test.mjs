// `turbidock view` of batches and studies while they run, and what attacks and bad input it withstands.
//
//   PROGRAM=../../../build/bin/turbidock node --test live_runs.test.mjs

import assert from 'node:assert/strict';
import {spawn} from 'node:child_process';
import {readFileSync, writeFileSync} from 'node:fs';
import http from 'node:http';
import path from 'node:path';
import {test} from 'node:test';
import {
  colours,
  folder,
  kLong_ms,
  kWaiting,
  morePictures,
  open,
  pictures,
  program,
  running,
  until,
  view,
} from './live_view.mjs';

test('a batch while it runs', async () => {
  writeFileSync(
    path.join(folder, 'plan.yaml'),
    `schema_version: 1
description: 'a <b id="injected">batch</b>'
scenario: sea_night_active
seeds: 100
set: {estimator.pose_source: true_pose, trial.duration_s: 30}
grid: {control.use: [pid, lqg]}
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
set: {estimator.pose_source: true_pose, control.use: lqg, trial.duration_s: 30}
tuning:
  gains:
    - {key: control.lqg.sway.effort_share, low: 0.09, high: 1.4, scale: log}
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
