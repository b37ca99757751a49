// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// The report of a build and the page of a fit in a headless Chromium without a network: sliders, levels, random faces,
// keyboard, tables, files that are saved.
// usage: report.mjs NODE_MODULES PROGRAMS WORK
import { execFileSync } from 'node:child_process';
import { existsSync, mkdirSync, readFileSync, rmSync, statSync } from 'node:fs';
import { createRequire } from 'node:module';
import { join, resolve } from 'node:path';
import { expect, openBrowser } from './browser.mjs';

const [modules, programs, work] = process.argv.slice(2).map((p) => resolve(p));
const run = (program, ...args) => execFileSync(join(programs, program), args, { encoding: 'utf8', stdio: ['ignore', 'pipe', 'inherit'] });
const browser = await openBrowser(modules);

rmSync(work, { recursive: true, force: true });
mkdirSync(work, { recursive: true });
const at = (name) => join(work, name);
run('generate-scans', '-n', '4', '--seed', '5', '-o', at('scans'), '-q');
rmSync(at('scans/truth'), { recursive: true });
run('build-model', at('scans'), '-o', at('model'), '-q');
run('render-mesh', at('scans/p000.ply'), '--landmarks', at('scans/p000.json'), '--size', '400', '-o', at('p.png'), '--write-landmarks', at('p.pts'), '-q');
run('fit-model', '--model', at('model/model.h5'), '--image', at('p.png'), '--landmarks', at('p.pts'), '-o', at('fit'), '-q');

const complaints = [], requests = [];
async function open(file, options = {}) {
  const context = await browser.newContext({ viewport: { width: 1280, height: 900 }, offline: true, acceptDownloads: true, ...options });
  const page = await context.newPage();
  page.on('console', (m) => { if (['error', 'warning'].includes(m.type())) complaints.push(m.text()); });
  page.on('pageerror', (e) => complaints.push(e.message));
  page.on('request', (r) => { if (!/^(data|blob):/.test(r.url())) requests.push(r.url()); });
  await page.goto(`file://${file}`);
  await page.evaluate(() => window.facewright.ready);
  return page;
}
// The canvas as numbers, just drawn.
const canvas = (page) => page.evaluate(() => {
  const { stage } = window.shown;
  stage.draw();
  const copy = document.createElement('canvas');
  copy.width = copy.height = 200;
  const context = copy.getContext('2d');
  context.drawImage(stage.canvas, 0, 0, 200, 200);
  return [...context.getImageData(0, 0, 200, 200).data];
});
const share = (a, b) => a.filter((x, i) => Math.abs(x - b[i]) > 8).length / a.length;
const positions = (page) => page.evaluate(() => [...window.shown.face.positions.subarray(0, window.shown.face.size)]);
const settle = (page) => page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
const slide = async (page, locator, value) => {
  await locator.evaluate((input, v) => { input.value = v; input.dispatchEvent(new Event('input', { bubbles: true })); }, value);
  await settle(page);
};
async function saved(page, part, name) {
  const [download] = await Promise.all([page.waitForEvent('download'), page.locator(`[data-part="${part}"]`).click()]);
  expect(download.suggestedFilename() === name, `a file called ${name}, got ${download.suggestedFilename()}`);
  await download.saveAs(at(name));
  return at(name);
}
const distance = (a, b) => JSON.parse(run('compare-meshes', a, b, '--align', 'none')).mean_mm;

const report = at('model/report/index.html');
const page = await open(report);
await page.evaluate(async () => { window.shown = await window.facewright.ready; });
expect(await page.evaluate(() => window.shown !== null), 'a viewer');

// It starts with the mean at the finest level, and the mean it saves is the one the build wrote.
expect((await positions(page)).length === 3 * 29587, 'the finest level first');
expect(distance(await saved(page, 'obj', 'face.obj'), at('model/levels/29587/mean.ply')) < 1e-3, 'the mean face in the saved OBJ');

// A slider moves the geometry and the picture, proportionally, and back.
const slider = page.locator('.slider input').first();
const mean = await positions(page), shownMean = await canvas(page);
await slide(page, slider, 1.5);
const half = await positions(page);
await slide(page, slider, 3);
const full = await positions(page), shownFull = await canvas(page);
const moved = Math.hypot(...full.map((x, i) => x - mean[i]));
expect(moved > 10, `the first mode to move the vertices, got ${moved} mm in all`);
expect(Math.hypot(...half.map((x, i) => 2 * (x - mean[i]) - (full[i] - mean[i]))) < 1e-3 * moved, 'displacements proportional to the coefficient');
expect(share(shownMean, shownFull) > 0.02, 'another picture');
expect((await page.locator('.slider output').first().textContent()) === '3.00', 'the value beside the slider');

// Levels: counts change, a coarser one is the first vertices of the finer.
for (const [index, vertices] of [[1, 16759], [0, 3448]]) {
  await page.locator('[data-part="level"]').selectOption(String(index));
  await settle(page);
  const coarse = await positions(page);
  expect(coarse.length === 3 * vertices, `${vertices} vertices, got ${coarse.length / 3}`);
  expect(coarse.every((x, i) => x === full[i]), 'the first vertices of the finest level');
  expect((await page.locator('[data-part="status"]').textContent()).startsWith(`${vertices} vertices`), 'the counts in words');
}

// Random faces differ from each other; the mean comes back exactly.
await page.locator('[data-part="level"]').selectOption('2');
await page.locator('[data-part="random"]').click();
await settle(page);
const first = await positions(page), shownFirst = await canvas(page);
await page.locator('canvas').focus();
await page.keyboard.press('r');
await settle(page);
const second = await positions(page);
expect(Math.hypot(...first.map((x, i) => x - second[i])) > 10, 'another random face');
expect(share(shownFirst, await canvas(page)) > 0.01, 'another picture of it');
const glb = await saved(page, 'glb', 'face.glb');
await page.locator('[data-part="mean"]').click();
await settle(page);
expect((await positions(page)).every((x, i) => x === mean[i]), 'the mean again');
if (existsSync(join(modules, 'gltf-validator'))) {
  const validator = createRequire(join(modules, 'any.js'))('gltf-validator');
  const { issues } = await validator.validateBytes(new Uint8Array(readFileSync(glb)));
  expect(issues.numErrors === 0 && issues.numWarnings === 0, `a valid GLB, got ${JSON.stringify(issues.messages)}`);
}

// Keyboard: a slider by its arrow keys, the view by those of the canvas.
await slider.focus();
for (let i = 0; i < 10; ++i) await page.keyboard.press('ArrowRight');
await settle(page);
expect(Number(await slider.inputValue()) > 0.05, 'arrow keys to move the slider');
expect((await positions(page)).some((x, i) => x !== mean[i]), 'and the face');
const before = await canvas(page);
await page.locator('canvas').focus();
for (let i = 0; i < 6; ++i) await page.keyboard.press('ArrowRight');
await settle(page);
expect(share(before, await canvas(page)) > 0.02, 'arrow keys to turn the face');

// What is shown: each choice changes the picture.
for (const part of ['grey', 'wireframe', 'landmarks', 'map']) {
  const was = await canvas(page);
  await page.locator(`[data-part="${part}"]`).check();
  await settle(page);
  expect(share(was, await canvas(page)) > 0.0005, `another picture with ${part}`);
  await page.locator(`[data-part="${part}"]`).uncheck();
  await settle(page);
}
const picture = readFileSync(await saved(page, 'picture', 'face.png'));
expect(picture.subarray(1, 4).toString() === 'PNG' && picture.length > 5000, 'a PNG of the face');

// The table sorts by its headings; numbers as numbers.
const column = async (n) => (await page.locator(`table.sortable tbody tr td:nth-child(${n})`).allTextContents()).map(Number);
const heading = page.locator('table.sortable thead th', { hasText: 'marks mm' });
await heading.locator('button').click();
const up = await column(7);
expect(up.length === 4 && up.every((x, i) => i === 0 || x >= up[i - 1]), `rows in ascending order, got ${up}`);
expect((await heading.getAttribute('aria-sort')) === 'ascending', 'the order told to screen readers');
await heading.locator('button').click();
expect((await column(7)).every((x, i, all) => i === 0 || x <= all[i - 1]), 'rows in descending order');

// Everything has a name, and every picture a description; the page has all its parts.
const nameless = await page.evaluate(() => [...document.querySelectorAll('input, select, button, canvas')]
  .filter((e) => !e.getAttribute('aria-label') && !e.textContent.trim() && !e.closest('label')?.textContent.trim()).length);
expect(nameless === 0, `names for all controls, ${nameless} lack one`);
expect(await page.evaluate(() => [...document.images].every((i) => i.hasAttribute('alt'))), 'a description of every picture');
for (const id of ['face', 'scans', 'modes', 'levels', 'quality', 'card', 'time'])
  expect((await page.locator(`h2#${id}`).count()) === 1, `the part ${id}`);
expect((await page.locator('.plots svg').count()) === 6, 'six plots');
expect(await page.evaluate(() => Promise.all([...document.images].map((i) => { i.loading = 'eager'; return i.decode(); })).then(() => true)), 'pictures that open');

// Both themes and a phone: nothing sticks out, text differs from its ground.
for (const colorScheme of ['light', 'dark'])
  for (const width of [1280, 390]) {
    const other = await open(report, { colorScheme, viewport: { width, height: 800 } });
    expect(await other.evaluate(() => document.documentElement.scrollWidth <= window.innerWidth), `no sideways scrolling at ${width}`);
    const [ground, ink] = await other.evaluate(() => [getComputedStyle(document.body).backgroundColor, getComputedStyle(document.body).color]);
    expect(/rgb\(2[0-9]{2}/.test(colorScheme === 'light' ? ground : ink), `a ${colorScheme} page, got ${ink} on ${ground}`);
    await other.screenshot({ path: at(`report_${colorScheme}_${width}.png`) });
    await other.context().close();
  }
expect(statSync(report).size < 25e6, `a report below 25 MB, got ${statSync(report).size}`);

// The page of a fit: the textured face, its picture, its numbers.
const fit = await open(at('fit/p.html'));
await fit.evaluate(async () => { window.shown = await window.facewright.ready; });
const textured = await canvas(fit);
await fit.locator('[data-part="grey"]').check();
await settle(fit);
expect(share(textured, await canvas(fit)) > 0.05, 'a texture on the face');
expect((await fit.locator('figure').count()) === 4, 'four pictures');
expect(distance(await saved(fit, 'obj', 'face.obj'), at('fit/p.obj')) < 1e-3, 'the fitted face in the saved OBJ');
expect((await fit.locator('tbody tr').first().textContent()).includes('°'), 'the pose');

expect(complaints.length === 0, `a silent console, got ${complaints}`);
expect(requests.every((url) => url.startsWith('file://') && url.endsWith('.html')), `no requests, got ${requests}`);
console.log(`report ${(statSync(report).size / 1e6).toFixed(1)} MB, fit ${(statSync(at('fit/p.html')).size / 1e6).toFixed(1)} MB`);
await browser.close();
