// What the tests of `turbidock view` share: the program, a Chromium, and what is waited for.

import assert from 'node:assert/strict';
import {spawn} from 'node:child_process';
import {mkdtempSync, readFileSync, rmSync} from 'node:fs';
import {createRequire} from 'node:module';
import os from 'node:os';
import path from 'node:path';
import {after, afterEach, before} from 'node:test';
import {chromium} from 'playwright-core';

export const program = path.resolve(process.env.PROGRAM || '../../../build/bin/turbidock');
export const axe = readFileSync(
  createRequire(import.meta.url).resolve('axe-core/axe.min.js'),
  'utf8',
);
export const kLong_ms = 90000; // a browser without a GPU on a busy machine

let browser;
export let folder;
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
export const running = [];
afterEach(async () => {
  for (const end of running.splice(0)) await end();
});

// A trial that goes on however long a busy machine takes: the vehicle waits in front of the marker.
export const kWaiting = [
  'pool_active',
  ...[
    'trial.duration_s=600',
    'procedure.found_hold_s=600',
    'procedure.search_yaw_v=0',
    'trial.after_docked_s=60',
  ].flatMap(assignment => ['--set', assignment]),
];

/**
 * Starts the program; {url, said(): what it said, stop(): ends it by Ctrl-C and gives what ended it, which a shell
 * calls 130}.
 */
export async function view(...words) {
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
export async function open(url, width = 1440) {
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
export async function until(page, f, argument, timeout_ms = kLong_ms) {
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
export const kChanges = 'section[aria-label="Changed while it ran"] tbody tr';

export const pictures = page =>
  page.evaluate(() => Number(document.documentElement.dataset.pictures || 0));
export const morePictures = (page, than) =>
  until(page, n => Number(document.documentElement.dataset.pictures || 0) > n, than);
export const state = (page, word) =>
  until(page, w => document.querySelector('.head .badge')?.textContent.includes(w), word);
/** How many frames the program has simulated, and how many of their rows are here. */
export const frames = page =>
  page.evaluate(() => {
    const {status, trialView} = globalThis.turbidock;
    return {simulated: status.frames, rows: trialView.series.length};
  });
/** Waits until the program stands still and all of it is here. Single frames always come with their picture. */
export const standsStill = page =>
  until(page, () => {
    const {status, trialView} = globalThis.turbidock;
    return !status.going && trialView.series.length === status.frames;
  });

// Not click(): without a GPU, on a busy machine, a page that always moves is never still enough for it.
export const press = locator => locator.dispatchEvent('click');

/** How many colours each canvas shows that a selector names. */
export const colours = (page, selector) =>
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
