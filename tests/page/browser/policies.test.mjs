// A report under a server's policy: with scripts of its own it draws itself, without it says what it found.

import assert from 'node:assert/strict';
import {readFileSync} from 'node:fs';
import path from 'node:path';
import {test} from 'node:test';
import {folder, newPage} from './opened.mjs';

const kReports = ['gate', 'batch', 'tuning', 'trial'];

/** The report as a server with this policy serves it; `more`: of the browser's context. */
async function served(name, policy, more = {}) {
  const page = await newPage(more);
  await page.route('http://reports.test/**', route =>
    route.fulfill({
      contentType: 'text/html; charset=utf-8',
      headers: policy ? {'Content-Security-Policy': policy} : {},
      body: readFileSync(path.join(folder, `${name}.html`), 'utf8'),
    }),
  );
  await page.goto(`http://reports.test/${name}.html`);
  return page;
}

for (const name of kReports) {
  test(`${name}: a policy that allows a page's own scripts is enough`, async () => {
    const page = await served(name, "script-src 'self' 'unsafe-inline'");
    await page.waitForSelector('html[data-ready=true]', {timeout: 60000});
    assert.equal(await page.locator('#plain').count(), 0);
    assert.ok((await page.locator('canvas').count()) + (await page.locator('table').count()) > 0);
    await page.context().close();
  });

  for (const [how, policy, more] of [
    ["'self' alone", "script-src 'self'", {}],
    ['no scripts at all', "script-src 'none'", {}],
    ['a browser without JavaScript', '', {javaScriptEnabled: false}],
  ])
    test(`${name}: ${how}`, async () => {
      const page = await served(name, policy, more);
      const said = await page.locator('#plain').innerText();
      assert.match(said, /The plots need JavaScript/);
      assert.ok((await page.locator('#plain h1').innerText()).length > 0);
      if (name === 'gate') {
        assert.match(said, /\n(pass|fail|inconclusive)\n/);
        assert.ok((await page.locator('#plain table tr').count()) > 3);
      }
      if (name === 'trial') assert.match(said, /\nsuccess\n/);
      await page.context().close();
    });
}
