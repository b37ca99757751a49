// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// Brings a page to life. Without this script, or without WebGL, its text and pictures are all there.
import { Face } from './face.js';
import { Panel } from './panel.js';
import { readPayload } from './payload.js';
import { Stage } from './stage.js';
import { makeSortable } from './table.js';

function theme() {
  const button = document.querySelector('#theme');
  if (!button) return;
  const dark = () => (document.documentElement.dataset.theme ?? (matchMedia('(prefers-color-scheme: dark)').matches ? 'dark' : 'light')) === 'dark';
  const show = () => { button.textContent = dark() ? 'Light' : 'Dark'; };
  button.hidden = false;
  button.addEventListener('click', () => {
    document.documentElement.dataset.theme = dark() ? 'light' : 'dark';
    show();
  });
  show();
}

async function viewer() {
  const root = document.querySelector('#viewer'), data = document.querySelector('#face-data');
  if (!root || !data) return null;
  try {
    const face = new Face(await readPayload(data));
    const image = document.querySelector('#face-texture');
    if (image) await image.decode();
    root.hidden = false; // before the stage asks how large it is
    const stage = new Stage(root.querySelector('canvas'), face, image);
    const panel = new Panel(root, face, stage, image);
    return { face, stage, panel };
  } catch (error) {
    root.hidden = false;
    root.replaceChildren(Object.assign(document.createElement('p'), {
      className: 'bad', textContent: `The face cannot be shown in three dimensions here: ${error.message}. The pictures on this page do without.`,
    }));
    console.warn(error);
    return null;
  }
}

theme();
document.querySelectorAll('table.sortable').forEach(makeSortable);
// For those who look at the page with a script.
window.facewright = { ready: viewer() };
