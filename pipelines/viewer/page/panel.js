// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// The controls beside the face.
import { normal } from './face.js';
import { glbBytes, objText, save } from './files.js';

const sigma = 0.75; // full draws of few scans leave the gamut of faces now and then
const shownAtFirst = 10; // sliders of a family
const words = { shape: 'Shape', colour: 'Colour', expression: 'Expression', blendshape: 'Named expressions' };

export class Panel {
  constructor(root, face, stage, textureImage) {
    Object.assign(this, { root, face, stage, textureImage, sliders: {} });
    this.find = (name) => root.querySelector(`[data-part="${name}"]`);
    this.fillLevels();
    const place = this.find('sliders');
    for (const family of ['shape', 'colour', 'expression', 'blendshape'])
      if (face.families[family].count > 0) place.append(this.group(family));
    this.wire();
    this.tell();
  }

  fillLevels() {
    const select = this.find('level');
    this.face.levels.forEach((level, l) => select.add(new Option(`${level.vertices} vertices, ${level.triangles} triangles`, l)));
    select.value = this.face.level;
    select.closest('label').hidden = this.face.levels.length < 2;
  }

  // The sliders of one family; the first are open, the others behind a summary.
  group(family) {
    const about = this.face.header.families[family];
    const group = document.createElement('fieldset');
    group.append(Object.assign(document.createElement('legend'), { textContent: words[family] }));
    this.sliders[family] = [];
    let rest = null;
    about.names.forEach((name, k) => {
      if (k === shownAtFirst) {
        rest = document.createElement('details');
        rest.append(Object.assign(document.createElement('summary'), { textContent: `${about.names.length - k} more` }));
        group.append(rest);
      }
      (rest ?? group).append(this.slider(family, k, name, about.share?.[k]));
    });
    return group;
  }

  slider(family, k, name, share) {
    const row = document.createElement('label');
    row.className = 'slider';
    const text = Object.assign(document.createElement('span'), { textContent: name });
    if (share) text.title = `${(100 * share).toFixed(1)} % of the variance`;
    const weight = family === 'blendshape';
    const input = Object.assign(document.createElement('input'), {
      type: 'range', min: weight ? 0 : -3, max: weight ? 1 : 3, step: 0.01, value: 0,
    });
    const output = Object.assign(document.createElement('output'), { textContent: '0.00' });
    input.setAttribute('aria-label', `${words[family]} ${name}${weight ? '' : ', standard deviations'}`);
    const show = () => { output.textContent = Number(input.value).toFixed(2); };
    input.addEventListener('input', () => {
      show();
      this.face.set(family, k, Number(input.value));
      this.later(family === 'colour' ? 'colour' : 'shape');
    });
    row.addEventListener('dblclick', () => {
      input.value = 0;
      input.dispatchEvent(new Event('input'));
    });
    this.sliders[family].push({ input, show });
    row.append(text, input, output);
    return row;
  }

  // Makes the face anew before the next picture, however many sliders have moved by then.
  later(what) {
    this.wanted = { ...this.wanted, [what]: true };
    if (this.waiting) return;
    this.waiting = requestAnimationFrame(() => {
      this.waiting = 0;
      const { shape = false, colour = false } = this.wanted;
      this.wanted = {};
      this.face.update({ shape, colour });
      this.stage.refresh();
    });
  }

  setAll(value) {
    for (const [family, list] of Object.entries(this.sliders))
      list.forEach(({ input, show }, k) => {
        input.value = value(family);
        show();
        this.face.set(family, k, Number(input.value));
      });
    this.later('shape');
    this.later('colour');
  }
  random() { this.setAll((family) => (family === 'shape' || family === 'colour' ? Math.max(-3, Math.min(3, sigma * normal())) : 0)); }

  tell(text) {
    const level = this.face.levels[this.face.level];
    this.find('status').textContent = text ?? `${level.vertices} vertices, ${level.triangles} triangles`;
  }

  wire() {
    const { face, stage } = this;
    const on = (name, event, act) => this.find(name)?.addEventListener(event, act);
    on('level', 'change', (e) => {
      face.setLevel(Number(e.target.value));
      stage.setLevel();
      this.tell();
    });
    on('random', 'click', () => this.random());
    on('mean', 'click', () => this.setAll(() => 0));
    for (const option of ['grey', 'wireframe', 'landmarks', 'map']) {
      const box = this.find(option);
      const possible = { grey: face.coloured || this.textureImage, wireframe: true, landmarks: face.landmarkNames.length > 0, map: face.uv };
      box.closest('label').hidden = !possible[option];
      box.checked = stage.options[option];
      box.addEventListener('change', () => stage.set(option, box.checked));
    }
    for (const button of this.root.querySelectorAll('[data-view]'))
      button.addEventListener('click', () => stage.look(button.dataset.view));
    on('turn', 'change', (e) => this.spin(e.target.checked));
    on('picture', 'click', async () => save('face.png', await stage.picture(), 'image/png'));
    on('obj', 'click', () => save('face.obj', objText(face), 'model/obj'));
    on('glb', 'click', async () => save('face.glb', await glbBytes(face, this.textureImage), 'model/gltf-binary'));
    this.find('random').hidden = this.find('mean').hidden = Object.keys(this.sliders).length === 0;
    this.wireCanvas();
  }

  wireCanvas() {
    const { stage } = this;
    const label = this.find('label');
    stage.canvas.addEventListener('pointermove', (e) => {
      const i = stage.landmarkAt(e.offsetX, e.offsetY);
      label.hidden = i < 0;
      if (i < 0) return;
      label.textContent = this.face.landmarkNames[i];
      label.style.left = `${e.offsetX}px`;
      label.style.top = `${e.offsetY}px`;
    });
    const keys = {
      ArrowLeft: () => stage.turn(-0.1), ArrowRight: () => stage.turn(0.1), f: () => stage.look('front'), l: () => stage.look('left'),
      r: () => this.random(), m: () => this.setAll(() => 0), w: () => this.find('wireframe').click(), g: () => this.find('grey').click(),
    };
    stage.canvas.addEventListener('keydown', (e) => {
      if (!keys[e.key] || e.ctrlKey || e.metaKey || e.altKey) return;
      keys[e.key]();
      e.preventDefault();
    });
  }

  spin(on) {
    this.spinning = on;
    let last = 0;
    const step = (now) => {
      if (!this.spinning) return;
      if (last) this.stage.turn((now - last) / 3000);
      last = now;
      requestAnimationFrame(step);
    };
    if (on) requestAnimationFrame(step);
  }
}
