// Measures what assets/measured/speed.md says: a live page's pictures a second, a large report's size, time to
// open and memory; medians over several times.
//
//   PROGRAM=../../../build/bin/turbidock node measure.mjs [REPORT.html]

import {spawn} from 'node:child_process';
import {readFileSync, statSync} from 'node:fs';
import os from 'node:os';
import path from 'node:path';
import {chromium} from 'playwright-core';

const kTimes = 5;
const kWatch_s = 12;
const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM || '/usr/bin/chromium',
  args: ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'],
});
const median = list => [...list].sort((a, b) => a - b)[list.length >> 1];

/** What the tab's process has for itself alone. */
async function ownMemory_MB() {
  const session = await browser.newBrowserCDPSession();
  const {processInfo} = await session.send('SystemInfo.getProcessInfo');
  const own = processInfo
    .filter(p => p.type === 'renderer')
    .map(p =>
      readFileSync(`/proc/${p.id}/smaps_rollup`, 'utf8')
        .match(/^Private_\w+: +\d+/gm)
        .reduce((sum, line) => sum + Number(line.match(/\d+/)[0]) / 1024, 0),
    );
  return Math.max(...own);
}

async function report(file) {
  const ready = [];
  const heap = [];
  const tab = [];
  for (let i = 0; i < kTimes; ++i) {
    const page = await browser.newPage({viewport: {width: 1440, height: 900}});
    await page.goto(`file://${path.resolve(file)}`);
    await page.waitForSelector('html[data-ready=true]', {timeout: 60000});
    ready.push(
      await page.evaluate(() => performance.getEntriesByName('turbidock-ready')[0].startTime),
    );
    const session = await page.context().newCDPSession(page);
    await session.send('HeapProfiler.collectGarbage');
    heap.push((await session.send('Runtime.getHeapUsage')).usedSize / 1e6);
    tab.push(await ownMemory_MB());
    await page.close();
  }
  console.log(
    `${(statSync(file).size / 1e6).toFixed(1)} MB, ready after ${median(ready).toFixed(0)} ms, ` +
      `heap ${median(heap).toFixed(0)} MB, tab ${median(tab).toFixed(0)} MB, ` +
      `load ${os.loadavg()[0].toFixed(1)}`,
  );
}

async function live(scenario) {
  const program = spawn(process.env.PROGRAM, ['view', scenario, '--port', '0'], {
    stdio: ['ignore', 'pipe', 'ignore'],
  });
  const ended = new Promise(resolve => program.on('close', resolve));
  const url = await new Promise(resolve =>
    program.stdout.on('data', data => resolve(String(data).trim())),
  );
  const page = await browser.newPage({viewport: {width: 1440, height: 900}});
  let received = 0; // bytes; nearly all of them pictures
  page.on('websocket', socket =>
    socket.on('framereceived', ({payload}) => {
      received += payload.length;
    }),
  );
  await page.goto(url);
  const pictures = () =>
    page.evaluate(() => Number(document.documentElement.dataset.pictures || 0));
  const simulated = () =>
    page.evaluate(() =>
      Number.parseFloat(
        [...document.querySelectorAll('.head .facts div')]
          .find(div => div.querySelector('dt').textContent === 'simulated')
          ?.querySelector('dd').textContent ?? 0,
      ),
    );
  while ((await pictures()) < 30) await new Promise(resolve => setTimeout(resolve, 100));
  // processor time, which other work on the machine does not change much
  const cpu_s = () =>
    readFileSync(`/proc/${program.pid}/stat`, 'utf8')
      .split(') ')[1]
      .split(' ')
      .slice(11, 13)
      .reduce((sum, ticks) => sum + ticks / 100, 0);
  const begin = performance.now();
  const before = [await pictures(), await simulated(), cpu_s(), received];
  await new Promise(resolve => setTimeout(resolve, 1000 * kWatch_s));
  const after = [await pictures(), await simulated(), cpu_s(), received];
  const passed_s = (performance.now() - begin) / 1000;
  program.kill('SIGINT');
  await ended;
  await page.close();
  console.log(
    `${scenario}: ${((after[0] - before[0]) / passed_s).toFixed(1)} pairs of pictures a second, ` +
      `${((after[1] - before[1]) / passed_s).toFixed(2)} x real time, ` +
      `${((1000 * (after[2] - before[2])) / (30 * (after[1] - before[1]))).toFixed(1)} ms of processor time a frame, ` +
      `load ${os.loadavg()[0].toFixed(1)}; ` +
      `${((after[3] - before[3]) / (after[0] - before[0]) / 1000).toFixed(0)} kB a pair of pictures`,
  );
}

try {
  if (process.argv[2]) await report(process.argv[2]);
  else for (const scenario of ['sea_night_active', 'pool_passive']) await live(scenario);
} finally {
  await browser.close();
}
