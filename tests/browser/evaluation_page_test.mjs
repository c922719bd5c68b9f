// The page of `corpus evaluate --html` or `corpus report`, opened from disk:
// node evaluation_page_test.mjs EVALUATION.html REPORT.html SCREENSHOT_STEM
// Exit 0: all held; 1: something did not; 77: there is no browser here.
import assert from 'node:assert/strict';
import { existsSync, mkdirSync } from 'node:fs';
import { dirname, resolve } from 'node:path';
import { pathToFileURL } from 'node:url';
import { expectFits, launchBrowser, listen, openPage, skip } from './environment.mjs';

const [, , pageFile, reportFile, screenshotStem] = process.argv;
if (!pageFile || !reportFile || !screenshotStem) {
  console.error('usage: node evaluation_page_test.mjs EVALUATION.html REPORT.html SCREENSHOT_STEM');
  process.exit(2);
}
for (const file of [pageFile, reportFile]) if (!existsSync(file)) skip(`${file} is not there`);

const browser = await launchBrowser();
const complaints = [];
let failed = false;
try {
  const page = await openPage(browser, { viewport: { width: 1160, height: 1500 } });
  listen(page, complaints);
  page.on('request', (request) => request.url().startsWith('file:') || complaints.push(`asks for ${request.url()}`));
  await page.goto(pathToFileURL(resolve(pageFile)).href);

  const rows = await page.locator('#lips tbody tr').count();
  assert.ok(rows === 8 || rows === 9, `${rows} rows; a ninth where the sound tells something`);
  const cells = await page.locator('#lips tbody tr').first().locator('td').allTextContents();
  assert.match(cells[1], /^\d+\.\d\d\d+\.\d\d to \d+\.\d\d$/, 'a measure and its interval');

  // The capture and every row, three plots; a triangle for each join; a name for each phone.
  assert.equal(await page.locator('#tracks svg').count(), 3);
  const strokes = () => page.locator('#tracks svg.opening_mm > path[fill=none]').count();
  assert.equal(await strokes(), rows + 1);
  assert.ok((await page.locator('#tracks svg.opening_mm > path.join').count()) > 0);
  const drawn = await page.locator('#tracks svg.opening_mm text').allTextContents();
  assert.ok(drawn.includes('sil'), drawn.join(' '));
  await page.locator('#rows input').first().uncheck();
  assert.equal(await strokes(), rows);

  const said = await page.locator('#said').textContent();
  await page.locator('#after').click();
  assert.notEqual(await page.locator('#said').textContent(), said);
  assert.equal(await page.locator('#of_take tbody tr').count(), rows);
  mkdirSync(dirname(screenshotStem), { recursive: true });
  await page.screenshot({ path: `${screenshotStem}_evaluation.png` });
  await expectFits(page);

  // The corpus report is made of the same pieces.
  await page.goto(pathToFileURL(resolve(reportFile)).href);
  assert.ok((await page.locator('#by_marker tbody tr').count()) > 0);
  assert.equal(await page.locator('#track svg > path').count(), 3);
  assert.ok((await page.locator('#track svg text').allTextContents()).includes('sil'));
  await page.screenshot({ path: `${screenshotStem}_report.png` });
  await expectFits(page);
  assert.deepEqual(complaints, []);
  console.log('six rows, three plots, two takes; the report has its curves');
} catch (error) {
  failed = true;
  console.error(error);
  console.error(complaints.join('\n'));
} finally {
  await browser.close();
}
process.exit(failed ? 1 : 0);
