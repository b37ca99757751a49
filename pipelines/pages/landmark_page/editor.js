// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// Places and mends the landmarks of scans by hand. The server's address carries a secret behind its #.
import { Landmarks } from './history.js';
import { fullName, groupsOfNames, inWords } from './names.js';
import { THREE, View } from './view.js';

const $ = (id) => document.getElementById(id);
const secret = location.hash.slice(1);
const view = new View($('canvas'));
const grabPixels = 12, clickPixels = 4, nudgePixels = 1;

let scans = [], current = -1, landmarks = new Landmarks({}), chosen = '31', loading = 0;

async function ask(path, options = {}) {
  let answer;
  try {
    answer = await fetch(path, { ...options, headers: { 'X-Facewright-Secret': secret } });
  } catch {
    throw new Error('landmark-scan no longer answers: was it stopped? Start it again; what is unsaved stays on this page');
  }
  if (answer.ok) return answer;
  if (answer.status === 403) throw new Error('open the whole address that landmark-scan printed, with what follows its #');
  const text = await answer.text();
  let message = text;
  try { message = JSON.parse(text).error ?? text; } catch { /* not ours */ }
  throw new Error(message || `${path}: ${answer.status}`);
}

function say(text, bad = false) {
  $('status').textContent = text;
  $('status').classList.toggle('bad', bad);
}
// Runs what may fail, and says why.
async function attempt(action) {
  try {
    return await action();
  } catch (error) {
    say(error.message, true);
    return undefined;
  }
}

function showNames() {
  const list = $('names'), known = new Set();
  list.replaceChildren();
  const item = (name, group) => {
    const li = document.createElement('li');
    li.id = `landmark-${name}`;
    li.role = 'option';
    li.dataset.name = name;
    li.classList.toggle('placed', landmarks.has(name));
    li.ariaSelected = String(name === chosen);
    li.title = group ? fullName(name) : name;
    const words = document.createElement('span');
    words.textContent = inWords(name);
    li.append(name, ' ', words);
    list.append(li);
    known.add(name);
  };
  const heading = (title) => {
    const li = document.createElement('li');
    li.className = 'group';
    li.role = 'presentation';
    li.textContent = title;
    list.append(li);
  };
  for (const { title, names } of groupsOfNames()) {
    heading(title);
    names.forEach((name) => item(name, title));
  }
  const others = [...new Set([...landmarks.names, chosen])].filter((name) => !known.has(name));
  if (others.length) heading('Others');
  others.forEach((name) => item(name, ''));
  list.setAttribute('aria-activedescendant', `landmark-${chosen}`);
  document.getElementById(`landmark-${chosen}`)?.scrollIntoView({ block: 'nearest' });
}

function refresh() {
  showNames();
  view.showLandmarks(landmarks, chosen);
  const bold = document.createElement('b');
  bold.textContent = chosen;
  $('chosen').replaceChildren(bold, ` ${fullName(chosen)} `, landmarks.has(chosen) ? '(placed)' : '(click on the scan to place it)');
  $('undo').disabled = !landmarks.canUndo;
  $('redo').disabled = !landmarks.canRedo;
  $('remove').disabled = !landmarks.has(chosen);
  $('save').disabled = !landmarks.changed;
  document.title = `${landmarks.changed ? '* ' : ''}${scans[current]?.id ?? ''} - landmarks`;
}

function choose(name) {
  chosen = name;
  refresh();
}
function order() { return [...$('names').querySelectorAll('[role=option]')].map((li) => li.dataset.name); }
function step(by) {
  const names = order();
  choose(names[(names.indexOf(chosen) + by + names.length) % names.length]);
}
// The next name without a place, after one was placed.
function advance() {
  const names = order(), at = names.indexOf(chosen);
  const next = [...names.slice(at + 1), ...names.slice(0, at)].find((name) => !landmarks.has(name));
  if (next) chosen = next;
}

function place(name, where) {
  landmarks.put(name, where);
  say('');
  refresh();
}
function follow(name) {
  if (!name) return;
  say('');
  choose(name);
}
function undo() { follow(landmarks.undo()); }
function redo() { follow(landmarks.redo()); }
function remove() { if (landmarks.has(chosen)) place(chosen, undefined); }

async function save() {
  if (!landmarks.changed) return true;
  const saving = landmarks, index = current;
  return attempt(async () => {
    const answer = await ask(`api/scans/${index}/landmarks`, { method: 'PUT', body: JSON.stringify(saving) });
    saving.markSaved();
    scans[index].landmarks = saving.names.length;
    say(`saved ${(await answer.json()).saved}`);
    showScans();
    refresh();
    return true;
  });
}

// Where the face looks and where its top is, by its landmarks if they tell.
function axes() {
  const at = (name) => (landmarks.has(name) ? view.local(landmarks.get(name)) : null);
  const right = at('37') ?? at('49'), left = at('46') ?? at('55'), nose = at('31'), low = at('9') ?? at('58') ?? at('49');
  if (!right || !left || !low || !nose) return null;
  const x = left.clone().sub(right).normalize();
  const eyes = at('37') && at('46') ? right.clone().add(left).multiplyScalar(0.5) : nose;
  const down = low.clone().sub(eyes);
  const y = down.clone().addScaledVector(x, -down.dot(x)).normalize().negate();
  return { x, y, z: x.clone().cross(y), nose, size: 2.7 * left.distanceTo(right) };
}
function look(which) {
  const found = axes();
  const { x, y, z } = found ?? { x: new THREE.Vector3(1, 0, 0), y: new THREE.Vector3(0, 1, 0), z: new THREE.Vector3(0, 0, 1) };
  if (which === 'roll') return view.roll();
  const from = which === 'left' ? x : which === 'right' ? x.clone().negate() : z;
  return view.look(from, y, found?.nose, found?.size);
}

function showScans() {
  $('scan').replaceChildren(...scans.map((scan, i) => {
    const option = new Option(`${scan.id} (${scan.error ? 'unreadable landmarks' : `${scan.landmarks} landmarks`})`, i);
    option.selected = i === current;
    return option;
  }));
  $('previous').disabled = current <= 0;
  $('next').disabled = current >= scans.length - 1;
}

async function open(index) {
  if (index < 0 || index >= scans.length) return;
  if (!(await save())) { // what was not saved is not left behind
    showScans();
    return;
  }
  const mine = ++loading;
  say(`reading ${scans[index].id} ...`);
  await attempt(async () => {
    const about = await (await ask(`api/scans/${index}`)).json();
    const bytes = await (await ask(`api/scans/${index}/mesh`)).arrayBuffer();
    let texture = null;
    if (about.texture && about.uv) {
      const url = URL.createObjectURL(await (await ask(`api/scans/${index}/texture`)).blob());
      texture = await new THREE.TextureLoader().loadAsync(url);
      URL.revokeObjectURL(url);
    }
    if (mine !== loading) return;
    current = index;
    landmarks = new Landmarks(about.landmarks);
    chosen = '31';
    showNames();
    chosen = landmarks.has('31') ? order().find((name) => !landmarks.has(name)) ?? '31' : '31';
    view.show(about, bytes, texture);
    view.shaded = $('shaded').checked;
    look('front');
    say([`${about.triangles.toLocaleString()} triangles`, ...about.warnings].join(' · '));
    refresh();
  });
  showScans();
}

// Pointing: a click places, a dot is dragged, all else turns the scan.
let pressed = null;
function nearest(x, y) {
  let best = null, reach = grabPixels;
  for (const name of landmarks.names) {
    const p = view.pixelOf(landmarks.get(name));
    const distance = p ? Math.hypot(p.x - x, p.y - y) : Infinity;
    if (distance < reach || (distance === reach && name === chosen)) [best, reach] = [name, distance];
  }
  return best;
}
$('canvas').addEventListener('pointerdown', (event) => {
  $('canvas').focus();
  if (event.button !== 0) return;
  const { offsetX: x, offsetY: y } = event;
  const grabbed = nearest(x, y);
  pressed = { x, y, grabbed, moved: false, before: grabbed && landmarks.get(grabbed), after: null };
  if (!grabbed) return;
  view.controls.enabled = false;
  $('canvas').setPointerCapture(event.pointerId);
  choose(grabbed);
}, { capture: true });
$('canvas').addEventListener('pointermove', (event) => {
  if (!pressed) return;
  const { offsetX: x, offsetY: y } = event;
  pressed.moved ||= Math.hypot(x - pressed.x, y - pressed.y) > clickPixels;
  if (!pressed.grabbed || !pressed.moved) return;
  const where = view.placeAt(x, y);
  if (!where) return;
  pressed.after = where;
  for (const dot of view.dots.children) if (dot.userData.name === pressed.grabbed) dot.userData.place = view.local(where);
  view.touch();
});
function release(event) {
  if (!pressed || event.button > 0) return;
  const { grabbed, moved, after } = pressed;
  pressed = null;
  view.controls.enabled = true;
  if (event.type === 'pointercancel') return refresh();
  if (grabbed) {
    if (after) place(grabbed, after);
  } else if (!moved) {
    const where = view.placeAt(event.offsetX, event.offsetY);
    if (!where) return say('there is no surface here');
    const isNew = !landmarks.has(chosen);
    landmarks.put(chosen, where);
    if (isNew) advance();
    say('');
    refresh();
  }
  return undefined;
}
$('canvas').addEventListener('pointerup', release);
$('canvas').addEventListener('pointercancel', release);

function nudge(dx, dy) {
  const p = landmarks.has(chosen) ? view.pixelOf(landmarks.get(chosen)) : null;
  const where = p && view.placeAt(p.x + dx * nudgePixels, p.y + dy * nudgePixels);
  if (where) place(chosen, where);
}
const arrows = { ArrowUp: [0, -1], ArrowDown: [0, 1], ArrowLeft: [-1, 0], ArrowRight: [1, 0] };
addEventListener('keydown', (event) => {
  if (event.target.matches('input, select')) return;
  const control = event.ctrlKey || event.metaKey, key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
  const actions = {
    z: control && (event.shiftKey ? redo : undo), y: control && redo, s: control && save,
    f: !control && (() => look('front')), r: !control && (() => look('roll')),
    Delete: remove, PageUp: () => open(current - 1), PageDown: () => open(current + 1),
  };
  let action = actions[key];
  if (arrows[key]) action = event.shiftKey ? () => nudge(...arrows[key]) : arrows[key][1] ? () => step(arrows[key][1]) : null;
  if (!action) return;
  event.preventDefault();
  action();
});

view.onFrame = () => {
  const place = pressed?.after ?? landmarks.get(chosen);
  const p = place && view.pixelOf(place);
  $('label').hidden = !p;
  if (!p) return;
  $('label').style.left = `${p.x}px`;
  $('label').style.top = `${p.y}px`;
  if ($('label').textContent !== chosen) $('label').textContent = chosen;
};
$('names').addEventListener('click', (event) => {
  const name = event.target.closest('[role=option]')?.dataset.name;
  if (name) choose(name);
});
$('add').addEventListener('submit', (event) => {
  event.preventDefault();
  const name = $('name').value.trim();
  $('name').value = '';
  if (name) choose(name);
});
$('scan').addEventListener('change', () => open(Number($('scan').value)));
$('previous').addEventListener('click', () => open(current - 1));
$('next').addEventListener('click', () => open(current + 1));
$('undo').addEventListener('click', undo);
$('redo').addEventListener('click', redo);
$('remove').addEventListener('click', remove);
$('save').addEventListener('click', save);
$('shaded').addEventListener('change', () => { view.shaded = $('shaded').checked; });
document.querySelectorAll('[data-view]').forEach((button) => button.addEventListener('click', () => look(button.dataset.view)));
addEventListener('beforeunload', (event) => { if (landmarks.changed) event.preventDefault(); });

await attempt(async () => {
  scans = await (await ask('api/scans')).json();
  showScans();
  await open(0);
});
