// What the tests of reports share: a Chromium, a report opened in it, what is drawn on its canvases.

import assert from 'node:assert/strict';
import {existsSync} from 'node:fs';
import path from 'node:path';
import {after, before} from 'node:test';
import {chromium} from 'playwright-core';

/** Of make_reports.sh. */
export const folder = path.resolve(process.env.REPORTS || 'reports');

let browser;
before(async () => {
  browser = await chromium.launch({
    executablePath: process.env.CHROMIUM || '/usr/bin/chromium',
    args: ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'],
  });
});
after(() => browser?.close());

/** An empty page in a context of its own. */
export const newPage = async options => (await browser.newContext(options)).newPage();

/** Opens a report; returns the page with what it complained about and asked for. */
export async function open(name, width, options = {}) {
  const file = path.join(folder, `${name}.html`);
  assert.ok(existsSync(file), `${file} was made`);
  const context = await browser.newContext({
    viewport: {width, height: width > 600 ? 900 : 844},
    colorScheme: 'light',
    ...options,
  });
  const page = await context.newPage();
  const complaints = [];
  const requests = [];
  page.on('console', message => {
    if (['error', 'warning'].includes(message.type())) complaints.push(message.text());
  });
  page.on('pageerror', error => complaints.push(error.message));
  page.on('request', request => {
    if (!/^(data|blob):/.test(request.url()) && request.url() !== `file://${file}`)
      requests.push(request.url());
  });
  await page.goto(`file://${file}`);
  await page.waitForSelector('html[data-ready=true]', {timeout: 60000});
  // what is drawn when it comes into view
  await page.evaluate(async () => {
    const seen = resolve => requestAnimationFrame(() => setTimeout(resolve, 60)); // a slow machine shows a place late
    const show = y => scrollTo({top: y, behavior: 'instant'}); // the page itself glides
    for (let y = 0; y < document.body.scrollHeight; y += 500) {
      show(y);
      await new Promise(seen);
    }
    show(0);
    await new Promise(r => setTimeout(r, 200));
  });
  return {page, complaints, requests, close: () => context.close()};
}

/** Of each canvas that is shown: the share of pixels unlike its most frequent colour, and how many colours it has. */
export const drawn = page =>
  page.evaluate(() =>
    [...document.querySelectorAll('canvas')]
      .filter(canvas => canvas.clientWidth > 0)
      .map(canvas => {
        const copy = document.createElement('canvas');
        copy.width = canvas.width;
        copy.height = canvas.height;
        const c = copy.getContext('2d');
        c.drawImage(canvas, 0, 0);
        const {data} = c.getImageData(0, 0, copy.width, copy.height);
        const counts = new Map();
        for (let i = 0; i < data.length; i += 4) {
          const key = `${data[i] >> 4},${data[i + 1] >> 4},${data[i + 2] >> 4},${data[i + 3] >> 6}`;
          counts.set(key, (counts.get(key) || 0) + 1);
        }
        const most = Math.max(...counts.values());
        return {
          label: canvas.getAttribute('aria-label'),
          scene: canvas.classList.contains('scene'),
          plot: Boolean(canvas.closest('.plot')),
          other: 1 - most / (data.length / 4),
          colors: counts.size,
        };
      }),
  );

export const isDrawn = plot => plot.other > 0.004 && plot.colors > 2;

// By a copy: getContext() here could be the first, and would decide how the page's own drawing is kept.
export const sceneDrawn = page =>
  page.waitForFunction(
    () => {
      const canvas = document.querySelector('canvas.scene');
      if (!canvas?.width) return false;
      const copy = Object.assign(document.createElement('canvas'), {
        width: canvas.width,
        height: canvas.height,
      }).getContext('2d');
      copy.drawImage(canvas, 0, 0);
      const {data} = copy.getImageData(0, 0, canvas.width, canvas.height);
      const colors = new Set();
      for (let i = 0; i < data.length; i += 4)
        colors.add(((data[i] >> 5) << 8) | ((data[i + 1] >> 5) << 4) | (data[i + 2] >> 5));
      return colors.size > 12; // vehicle, station and balls, not only the water
    },
    null,
    {timeout: 120000, polling: 1000},
  );
