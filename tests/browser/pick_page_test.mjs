// Clicks the anchors on the page of `retarget pick` with the default face: node pick_page_test.mjs PAGE.html SCREENSHOT_STEM
// Exit 0: all held; 1: something did not; 77: there is no browser here.
import assert from 'node:assert/strict';
import { existsSync, mkdirSync } from 'node:fs';
import { dirname, resolve } from 'node:path';
import { pathToFileURL } from 'node:url';
import { launchBrowser, listen, openPage, skip } from './environment.mjs';

const [, , pageFile, screenshotStem] = process.argv;
if (!pageFile || !screenshotStem) {
  console.error('usage: node pick_page_test.mjs PAGE.html SCREENSHOT_STEM');
  process.exit(2);
}
if (!existsSync(pageFile)) skip(`${pageFile} is not there`);

// Vertices of the default face: the tracker's landmarks.
const LANDMARKS = {
  LIP_CORNER_R: 61, LIP_CORNER_L: 291, LIP_UP_MID: 0, LIP_LO_MID: 17, NOSE_TIP: 1, CHIN_LOW: 152,
  CANTHUS_OUT_R: 33, CANTHUS_OUT_L: 263, EYE_IN_R: 133, EYE_IN_L: 362,
};
const WITHIN_MM = 5;  // a click takes the nearest corner of the triangle it meets

const browser = await launchBrowser();
const complaints = [];
let failed = false;
try {
  const page = await openPage(browser, { viewport: { width: 1200, height: 900 } });
  listen(page, complaints);
  await page.goto(pathToFileURL(resolve(pageFile)).href);
  await page.waitForFunction(() => window.picker, null, { timeout: 60000 });
  assert.equal(await page.locator('#save').isDisabled(), true);
  for (const vertex of Object.values(LANDMARKS)) {
    const [x, y] = await page.evaluate((v) => window.picker.shownAt(window.picker.at(v)), vertex);
    await page.mouse.click(x, y);
  }
  assert.equal(await page.evaluate(() => window.picker.complaint()), '');
  // Skin that folds beside lips and eyes does not turn the face to its side.
  const folded = Object.entries(LANDMARKS).filter(([name]) => /^(LIP_CORNER|CANTHUS_OUT)/.test(name)).map(([, vertex]) => vertex);
  assert.equal(await page.evaluate((vertices) => {
    const { normals, complaint } = window.picker;
    const before = normals.slice();
    for (const v of vertices) normals.set([1, 0, 0], 3 * v);
    const told = complaint();
    normals.set(before);
    return told;
  }, folded), '');
  // A click in the wrong place is told of, and taken back.
  await page.locator('#list button').nth(0).click();
  const left = await page.evaluate((v) => window.picker.shownAt(window.picker.at(v)), LANDMARKS.CANTHUS_OUT_L);
  await page.mouse.click(...left);
  assert.match(await page.locator('#warning').textContent(), /LIP_CORNER_R/);
  await page.locator('#undo').click();
  assert.equal(await page.locator('#warning').isHidden(), true);
  // A part that is hidden is not clicked on.
  await page.evaluate(() => document.querySelector('#shown').open = true);
  await page.locator('#parts input').first().uncheck();
  assert.equal(await page.evaluate(() => window.picker.hiddenParts.size), 1);
  await page.locator('#parts input').first().check();
  const { markers } = JSON.parse(await page.evaluate(() => window.picker.anchorsText()));
  assert.deepEqual(Object.keys(markers).sort(), Object.keys(LANDMARKS).sort());
  for (const [name, vertex] of Object.entries(LANDMARKS)) {
    const away = await page.evaluate(([a, b]) => {
      const [p, q] = [window.picker.at(a), window.picker.at(b)];
      return Math.hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]);
    }, [markers[name], vertex]);
    assert.ok(away < WITHIN_MM, `${name}: ${away} mm from where it was clicked`);
  }
  const download = page.waitForEvent('download');
  await page.locator('#save').click();
  assert.equal((await download).suggestedFilename(), 'default.anchors.json');
  mkdirSync(dirname(screenshotStem), { recursive: true });
  await page.screenshot({ path: `${screenshotStem}_anchors.png` });
  assert.deepEqual(complaints, []);
  console.log('ten anchors clicked and saved');
} catch (error) {
  failed = true;
  console.error(error);
} finally {
  await browser.close();
}
process.exit(failed ? 1 : 0);
