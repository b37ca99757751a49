// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// Places, drags, nudges, removes, undoes and saves landmarks on the page of landmark-scan --edit with a real mouse and
// keyboard, and reads the files that are written.
// usage: node edit_landmarks.mjs NODE_MODULES BIN WORK_FOLDER
import { execFileSync, spawn } from 'node:child_process';
import { existsSync, mkdirSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { request } from 'node:http';
import { join } from 'node:path';
import { expect, openBrowser, skip } from './browser.mjs';

const [modules, bin, work] = process.argv.slice(2);
const browser = await openBrowser(modules);
if (!existsSync(join(modules, 'three'))) skip('no three');
const scans = join(work, 'scans'), marks = join(work, 'marks');
rmSync(work, { recursive: true, force: true });
mkdirSync(marks, { recursive: true });
execFileSync(join(bin, 'generate-scans'), ['-n', '2', '--seed', '5', '-o', scans, '-q']);
const ids = execFileSync('ls', [scans]).toString().split('\n').filter((name) => name.endsWith('.ply')).map((name) => name.slice(0, -4));
const original = JSON.parse(readFileSync(join(scans, `${ids[0]}.json`)));
writeFileSync(join(marks, `${ids[0]}.json`), JSON.stringify(Object.fromEntries(
  Object.entries(original).map(([name, x]) => [name, name === '40' ? { position: x, stddev: 2.5 } : x]))));
const read = (id) => JSON.parse(readFileSync(join(marks, `${id}.json`)));
const distance = (a, b) => Math.hypot(...a.map((x, k) => x - b[k]));

const server = spawn(join(bin, 'landmark-scan'), ['--edit', scans, '-o', marks]);
const ended = new Promise((resolve) => server.on('exit', resolve));
const address = await new Promise((resolve, reject) => {
  let text = '';
  server.stdout.on('data', (data) => {
    const found = (text += data).match(/open (http:\S+)/);
    if (found) resolve(found[1]);
  });
  server.stderr.on('data', (data) => reject(new Error(String(data))));
});

try {
  const page = await browser.newPage({ viewport: { width: 1280, height: 800 } });
  const complaints = [], elsewhere = [];
  page.on('console', (message) => ['error', 'warning'].includes(message.type()) && !/GPU stall|swiftshader/i.test(message.text()) && complaints.push(message.text()));
  page.on('pageerror', (error) => complaints.push(String(error)));
  page.on('request', (r) => /^(blob:|data:)/.test(r.url()) || r.url().startsWith(new URL(address).origin) || elsewhere.push(r.url()));
  await page.goto(address);
  const isPlaced = (name) => page.locator(`#landmark-${name}`).evaluate((li) => li.classList.contains('placed'));
  const ready = () => page.waitForFunction(() => /triangles/.test(document.getElementById('status').textContent), null, { timeout: 60000 });
  const drawn = () => page.evaluate(async () => {
    for (let i = 0; i < 3; ++i) await new Promise((resolve) => requestAnimationFrame(resolve));
  });
  const choose = async (name) => {
    await page.locator(`#landmark-${name}`).click();
    await drawn();
    return page.evaluate(() => {
      const at = document.getElementById('canvas').getBoundingClientRect(), style = document.getElementById('label').style;
      return { x: at.x + parseFloat(style.left), y: at.y + parseFloat(style.top) };
    });
  };
  const saved = async () => {
    await page.keyboard.press('Control+s');
    await page.waitForFunction(() => /^saved/.test(document.getElementById('status').textContent));
    return read(ids[0]);
  };
  await ready();
  expect(await page.locator('#names li.placed').count() === Object.keys(original).length, 'every landmark of the file is shown');
  await page.screenshot({ path: join(work, 'light.png') });

  const nose = await choose('31');
  await page.keyboard.press('Delete');
  expect(!(await isPlaced('31')), 'Delete removes the chosen landmark');
  await page.mouse.click(nose.x, nose.y);
  expect(await isPlaced('31'), 'a click places the chosen landmark');
  let file = await saved();
  expect(distance(file['31'], original['31']) < 1.5, `a click where the nose was is on the nose, not ${distance(file['31'], original['31'])} mm away`);
  expect(file['40'].stddev === 2.5, 'a landmark that stays keeps its standard deviation');
  expect(Object.keys(original).every((name) => ['31', '40'].includes(name) || distance(file[name], original[name]) === 0), 'landmarks that stay keep their digits');

  const corner = await choose('55');
  await page.mouse.move(corner.x, corner.y);
  await page.mouse.down();
  await page.mouse.move(corner.x + 20, corner.y, { steps: 5 });
  await page.mouse.up();
  file = await saved();
  const dragged = file['55'];
  expect(distance(dragged, original['55']) > 2, 'a dragged dot moves');
  await page.keyboard.press('Control+z');
  file = await saved();
  expect(distance(file['55'], original['55']) === 0, 'undo brings it back exactly');
  await page.keyboard.press('Control+Shift+z');
  file = await saved();
  expect(distance(file['55'], dragged) === 0, 'redo drags it again');

  const camera = await choose('9');
  await page.mouse.move(1000, 700);
  await page.mouse.down();
  await page.mouse.move(900, 700, { steps: 5 });
  await page.mouse.up();
  const turned = await choose('9');
  expect(Math.hypot(turned.x - camera.x, turned.y - camera.y) > 5, 'a drag beside the dots turns the scan');
  expect(await page.locator('#save').isDisabled(), 'turning moves no landmark');
  await page.locator('#canvas').focus();
  await page.keyboard.press('f');
  await choose('52');
  await page.keyboard.press('Shift+ArrowRight');
  file = await saved();
  expect(distance(file['52'], original['52']) > 0.01 && distance(file['52'], original['52']) < 2, 'Shift+arrow nudges');
  await page.keyboard.press('ArrowDown');
  expect(await page.locator('#landmark-53').getAttribute('aria-selected') === 'true', 'arrow keys choose');

  await page.fill('#name', 'mole');
  await page.keyboard.press('Enter');
  await page.mouse.click(nose.x + 30, nose.y + 30);
  await page.keyboard.press('PageDown');
  await page.waitForFunction((id) => document.title.startsWith(id), ids[1]);
  expect('mole' in read(ids[0]), 'landmarks of other names are kept, and saved when another scan is opened');
  await page.emulateMedia({ colorScheme: 'dark' });
  await page.setViewportSize({ width: 420, height: 800 });
  await drawn();
  await page.screenshot({ path: join(work, 'dark_narrow.png') });

  const status = (path, headers) => new Promise((resolve, reject) => {
    const { hostname, port } = new URL(address);
    request({ hostname, port, path, headers }, (answer) => { answer.resume(); resolve(answer.statusCode); }).on('error', reject).end();
  });
  const secret = new URL(address).hash.slice(1);
  expect(await status('/api/scans', {}) === 403, 'nothing without the secret');
  expect(await status('/api/scans', { 'X-Facewright-Secret': secret }) === 200, 'all with it');
  expect(await status('/api/scans', { 'X-Facewright-Secret': secret, Host: 'example.org' }) === 403, 'nothing under another host');
  expect(await status('/api/scans/99/mesh', { 'X-Facewright-Secret': secret }) === 404, 'no scan that is not in the list');
  expect(await status('/..%2f..%2fetc/passwd', {}) === 404, 'no file of the machine');
  expect(elsewhere.length === 0, `no request leaves the machine: ${elsewhere}`);
  expect(complaints.length === 0, `the page complains of nothing: ${complaints.join('; ')}`);
} finally {
  await browser.close();
  server.kill('SIGINT');
}
expect(await ended === 0, 'Ctrl+C ends the program in peace');
console.log('all as expected');
