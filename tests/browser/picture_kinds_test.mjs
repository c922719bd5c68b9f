// A head whose only texture is WebP, or KTX2, on the pick, fit and view page:
// node picture_kinds_test.mjs HEAD.glb ANCHORS.json CLOCK.corpus RETARGET SYNTH SCRATCH_FOLDER SCREENSHOT_STEM
// HEAD.glb: a head whose only image is a PNG (tests/unit/retarget/dressed_glb_test.cpp).
import assert from 'node:assert/strict';
import { spawnSync } from 'node:child_process';
import { existsSync, readFileSync, writeFileSync } from 'node:fs';
import { join, resolve } from 'node:path';
import { pathToFileURL } from 'node:url';
import { launchBrowser, listen, openPage, prepareFolders, requireFromViewer, runChecks, skip, untilFace } from './environment.mjs';

const [head, anchors, corpus, retarget, synth, scratch, screenshotStem] = process.argv.slice(2);
const missing = [head, anchors, corpus].find((file) => !existsSync(file));
if (missing) skip(`${missing} is not there`);
prepareFolders(scratch, screenshotStem);
const validator = requireFromViewer('gltf-validator');

/** The chunks of a GLB. */
function parted(glb) {
  const length = glb.readUInt32LE(12);
  return { root: JSON.parse(glb.subarray(20, 20 + length).toString()), binary: glb.subarray(28 + length, 28 + length + glb.readUInt32LE(20 + length)) };
}

function joined({ root, binary }) {
  const pad = (bytes, fill) => Buffer.concat([bytes, Buffer.alloc((4 - (bytes.length % 4)) % 4, fill)]);
  const json = pad(Buffer.from(JSON.stringify(root)), 0x20), data = pad(binary, 0);
  const words = (...values) => Buffer.from(Uint32Array.from(values).buffer);
  return Buffer.concat([Buffer.from('glTF'), words(2, 28 + json.length + data.length, json.length), Buffer.from('JSON'), json, words(data.length), Buffer.from('BIN\0'), data]);
}

const imageOf = ({ root, binary }) => {
  const { byteOffset = 0, byteLength } = root.bufferViews[root.images[0].bufferView];
  return binary.subarray(byteOffset, byteOffset + byteLength);
};

/** `head`, `size` times as large, with `picture` in place of its own, known by `extension` alone. */
function repainted(mime, extension, picture, size) {
  const { root, binary } = parted(readFileSync(head));
  const [scene] = root.scenes;
  root.nodes.push({ name: 'sized', scale: [size, size, size], children: scene.nodes });
  scene.nodes = [root.nodes.length - 1];
  const start = binary.length + ((4 - (binary.length % 4)) % 4);
  root.bufferViews.push({ buffer: 0, byteOffset: start, byteLength: picture.length });
  root.images = [{ bufferView: root.bufferViews.length - 1, mimeType: mime }];
  root.samplers = [{ magFilter: 9728, wrapS: 33071 }];
  root.textures = [{ sampler: 0, extensions: { [extension]: { source: 0 } } }];
  root.extensionsUsed = root.extensionsRequired = [extension];
  for (const material of root.materials) {
    material.pbrMetallicRoughness = { ...material.pbrMetallicRoughness, baseColorFactor: [1, 1, 1, 1], baseColorTexture: { index: 0 } };
  }
  root.buffers[0].byteLength = start + picture.length;
  return joined({ root, binary: Buffer.concat([binary, Buffer.alloc(start - binary.length), picture]) });
}

function run(program, args) {
  const ran = spawnSync(program, [...args, '--quiet'], { encoding: 'utf8' });
  assert.equal(ran.status, 0, `${args.join(' ')}: ${ran.stderr}`);
}

const browser = await launchBrowser();
const complaints = [];
const page = await openPage(browser, { viewport: { width: 1000, height: 800 } });
listen(page, complaints);

/** Shares of the canvas that are green and that are not the paper behind the head. */
async function seen(selector) {
  const png = (await page.locator(selector).screenshot()).toString('base64');
  return page.evaluate(async (data) => {
    const image = new Image();
    image.src = `data:image/png;base64,${data}`;
    await image.decode();
    const canvas = Object.assign(document.createElement('canvas'), { width: image.width, height: image.height });
    const context = canvas.getContext('2d');
    context.drawImage(image, 0, 0);
    const { data: pixels } = context.getImageData(0, 0, image.width, image.height);
    let green = 0, head = 0;
    for (let i = 0; i < pixels.length; i += 4) {
      const others = Math.max(pixels[i], pixels[i + 2]);
      green += pixels[i + 1] > 1.5 * others + 20 ? 1 : 0;
      head += Math.abs(pixels[i] - pixels[0]) + Math.abs(pixels[i + 1] - pixels[1]) + Math.abs(pixels[i + 2] - pixels[2]) > 40 ? 1 : 0;
    }
    return { green: (4 * green) / pixels.length, head: (4 * head) / pixels.length };
  }, png);
}

const LEAST_SHARE = 0.1;  // of the canvas; a head fills a fourth of it or more
const MOST_SHARE = 0.8;
const painted = ({ green }) => assert.ok(green > LEAST_SHARE, `only ${green} of the page is as green as the texture`);
const bare = ({ green, head: share }) => {
  assert.ok(green < 0.01, `${green} of the page is green`);
  assert.ok(share > LEAST_SHARE && share < MOST_SHARE, `${share} of the page shows a head`);
};

/** Drags a marker from where it is to where another one is, some pixels beside it. */
async function dragMarker(from, to) {
  const [start, end] = await page.evaluate((names) => names.map((name) => window.picker.shownAt(window.picker.places.get(name))), [from, to]);
  await page.mouse.move(...start);
  await page.mouse.down();
  for (const share of [0.5, 1]) await page.mouse.move(...start.map((value, axis) => value + share * (end[axis] + 4 - value)));
  await page.mouse.up();
}

/** On the page of a fit: what is dragged to the wrong side, or one lip's marker onto the other lip, is told of. */
async function dragWrongly() {
  const warning = page.locator('#warning');
  assert.equal(await warning.isHidden(), true, 'the fit placed its markers rightly');
  for (const [from, to] of [['CANTHUS_OUT_R', 'CANTHUS_OUT_L'], ['BROW_IN_R', 'BROW_OUT_L'], ['LIP_UP_IN_R', 'CHIN_UP']]) {
    await dragMarker(from, to);
    assert.match(await warning.textContent(), new RegExp(from));
    if (from === 'BROW_IN_R') await page.screenshot({ path: `${screenshotStem}_dragged.png` });
    await page.locator('#undo').click();
    assert.equal(await warning.isHidden(), true, `${from} is back`);
  }
}

/** The files and pages of one kind of picture; `look` judges what is seen, `note` what is said. */
function checksOf(kind, mime, extension, picture, size, look, note) {
  const file = (ending) => join(scratch, `${kind}${ending}`);
  const show = (name) => page.goto(pathToFileURL(resolve(file(name))).href);
  const lookAt = async (name, selector) => {
    await page.waitForTimeout(500);  // a picture is decoded after the page is there
    await page.screenshot({ path: `${screenshotStem}_${kind}_${name}.png` });
    look(await seen(selector));
  };
  return {
    async [`${kind}: fits, with a page to pick on and one that shows the fit`]() {
      writeFileSync(file('.glb'), repainted(mime, extension, picture, size));
      const { markers } = JSON.parse(readFileSync(anchors));
      const sized = Object.entries(markers).map(([name, place]) => [name, place.map((value) => size * value)]);
      writeFileSync(file('.json'), JSON.stringify({ markers: Object.fromEntries(sized) }));
      run(retarget, ['pick', file('.glb'), '--out', file('.pick.html')]);
      run(retarget, ['fit', '--mesh', file('.glb'), '--anchors', file('.json'), '--corpus', corpus, '--out', file('.face'),
        '--show', file('.fit.html')]);
      for (const name of ['pick', 'fit']) {
        await show(`.${name}.html`);
        await page.waitForFunction(() => window.picker);
        assert.equal(await page.locator('#note').isVisible(), note !== null);
        if (note) assert.match(await page.locator('#note').textContent(), note);
        await lookAt(name, '#view');
      }
      if (note === null) await dragWrongly();
    },
    async [`${kind}: what speaks has the picture, untouched`]() {
      run(synth, ['--text', 'pa', '--corpus', corpus, '--face', file('.face'), '-o', file('.talk.glb'), '-o', file('.view.html')]);
      const [before, after] = ['.glb', '.talk.glb'].map((ending) => parted(readFileSync(file(ending))));
      assert.ok(after.root.animations.some(({ name }) => name === 'speech'));
      assert.deepEqual(imageOf(after), picture);
      for (const key of ['textures', 'samplers', 'materials', 'extensionsUsed', 'extensionsRequired']) {
        assert.deepEqual(after.root[key], before.root[key], key);
      }
      const { issues } = await validator.validateBytes(new Uint8Array(readFileSync(file('.talk.glb'))), { maxIssues: 20 });
      assert.equal(issues.numErrors, 0, JSON.stringify(issues.messages));
    },
    async [`${kind}: the page of a line shows the head`]() {
      await show('.view.html');
      await untilFace(page);
      assert.equal(await page.locator('#notice').isVisible(), false, 'nothing lies on the face');
      const told = await page.locator('#doubts li').allTextContents();
      assert.equal(told.some((line) => /texture/.test(line)), note !== null);
      if (note) assert.match(told.join(' '), note);
      await lookAt('view', '#view');
      const apart = await page.evaluate(() => window.mouthpiece.lipOpening());
      assert.ok(apart > 2 && apart < 40, `the lips' middles are ${apart} mm apart`);
    },
  };
}

/** A green picture as WebP, by Chromium's own encoder. */
async function greenWebp() {
  await page.goto('about:blank');
  const url = await page.evaluate(() => {
    const canvas = Object.assign(document.createElement('canvas'), { width: 16, height: 16 });
    const context = canvas.getContext('2d');
    context.fillStyle = '#10d020';
    context.fillRect(0, 0, 16, 16);
    return canvas.toDataURL('image/webp');
  });
  assert.match(url, /^data:image\/webp/);
  return Buffer.from(url.split(',')[1], 'base64');
}

/** A KTX2 file's first bytes: here nobody opens it. */
const ktx2 = Buffer.from([0xab, 0x4b, 0x54, 0x58, 0x20, 0x32, 0x30, 0xbb, 0x0d, 0x0a, 0x1a, 0x0a, 1, 2, 3, 4]);

const checks = {
  ...checksOf('webp', 'image/webp', 'EXT_texture_webp', await greenWebp(), 1, painted, null),
  ...checksOf('ktx2', 'image/ktx2', 'KHR_texture_basisu', ktx2, 30, bare, /KTX2 textures, which this page cannot show/),
  async 'nothing was complained about'() {
    assert.deepEqual(complaints, []);
  },
};

await runChecks(checks, page, () => browser.close());
