// Takes the pictures of the pages in a folder (make_pictures.sh), and one of a live page: 1440 x 900 pixels of
// the first screen, as JPEG of 1200 x 750. All of them, or those named: trial, batch, ..., live.
//
//   PROGRAM=../../../build/bin/turbidock node take_pictures.mjs FOLDER PICTURES [NAME...]

import {spawn} from 'node:child_process';
import path from 'node:path';
import {chromium} from 'playwright-core';

const [folder, pictures] = process.argv.slice(2, 4).map(name => path.resolve(name));
const named = process.argv.slice(4);
const isWanted = name => !named.length || named.includes(name);
const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM || '/usr/bin/chromium',
  args: ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'],
});
const open = () =>
  browser.newPage({
    viewport: {width: 1440, height: 900},
    deviceScaleFactor: 1200 / 1440,
    colorScheme: 'light',
  });
const take = (page, name) =>
  page.screenshot({
    path: path.join(pictures, `page_${name}.jpg`),
    type: 'jpeg',
    quality: 72,
    timeout: 120000,
  });
const settled = () => new Promise(resolve => setTimeout(resolve, 4000));

for (const name of ['trial', 'batch', 'compare', 'tuning', 'gate', 'recognition'].filter(
  isWanted,
)) {
  const page = await open();
  await page.goto(`file://${folder}/${name}.html`);
  await page.waitForSelector('html[data-ready=true]');
  if (name === 'trial')
    await page.evaluate(() =>
      globalThis.turbidock.clock.seek(0.8 * globalThis.turbidock.clock.end),
    );
  await settled();
  await take(page, name);
  await page.close();
}

if (isWanted('live')) await takeLive();
await browser.close();

async function takeLive() {
  const program = spawn(
    process.env.PROGRAM,
    ['view', 'sea_night_active', '--port', '0', '--quiet'],
    {stdio: ['ignore', 'pipe', 'inherit']},
  );
  try {
    const url = await new Promise((resolve, reject) => {
      program.stdout.on('data', data => resolve(String(data).trim()));
      program.on('exit', () => reject(new Error('turbidock view has ended')));
    });
    const page = await open();
    await page.goto(url);
    const simulated = () =>
      page.evaluate(() =>
        Number.parseFloat(
          [...document.querySelectorAll('.head .facts div')]
            .find(div => div.querySelector('dt').textContent === 'simulated')
            ?.querySelector('dd').textContent ?? 0,
        ),
      );
    while ((await simulated()) < 8) await new Promise(resolve => setTimeout(resolve, 250));
    await page.locator('.play').dispatchEvent('click');
    await settled();
    await take(page, 'live');
  } finally {
    program.kill('SIGINT');
  }
}
