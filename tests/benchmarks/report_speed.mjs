// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// How fast a report is: milliseconds to its first picture of the face, and for each level the milliseconds of making a
// face from its coefficients and of drawing it, and the frames per second while a slider is dragged. Chromium draws in
// software here; a graphics card does better.
// usage: node tests/benchmarks/report_speed.mjs NODE_MODULES OUT/report/index.html
import { resolve } from 'node:path';
import { statSync } from 'node:fs';
import { openBrowser } from '../pages/browser.mjs';

const [modules, report] = process.argv.slice(2);
const browser = await openBrowser(modules);
const page = await (await browser.newContext({ viewport: { width: 1280, height: 900 }, offline: true })).newPage();
const start = Date.now();
await page.goto(`file://${resolve(report)}`);
await page.evaluate(async () => {
  window.shown = await window.facewright.ready;
  await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
});
console.log(`size ${(statSync(report).size / 1e6).toFixed(1)} MB, first picture after ${Date.now() - start} ms`);
console.log('level     modes  face ms  draw ms  frames/s');
for (const level of [0, 1, 2]) {
  const row = await page.evaluate(async (l) => {
    const { face, stage, panel } = window.shown;
    if (l >= face.levels.length) return null;
    face.setLevel(l);
    stage.setLevel();
    const list = panel.sliders.shape;
    list.forEach(({ input }, k) => face.set('shape', k, 0.1 * (k % 7)));
    const timed = (act) => {
      const times = [];
      for (let i = 0; i < 15; ++i) {
        const t = performance.now();
        act();
        times.push(performance.now() - t);
      }
      return times.sort((a, b) => a - b)[7];
    };
    const gl = stage.renderer.getContext(), pixel = new Uint8Array(4);
    const make = timed(() => face.update());
    const draw = timed(() => {
      stage.refresh();
      stage.draw();
      gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel); // waits until it is drawn
    });
    const frames = stage.frames, began = performance.now();
    let i = 0;
    while (performance.now() - began < 3000) {
      list[0].input.value = 3 * Math.sin(i++ / 20);
      list[0].input.dispatchEvent(new Event('input', { bubbles: true }));
      await new Promise((done) => requestAnimationFrame(done));
    }
    return [face.levels[l].vertices, list.length, make.toFixed(1), draw.toFixed(1), ((stage.frames - frames) / 3).toFixed(0)];
  }, level);
  if (row) console.log(row.map((x, i) => String(x).padEnd([9, 6, 8, 8, 8][i])).join(' '));
}
await browser.close();
