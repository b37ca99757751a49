// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// three.js loads the file, knows the morph targets by name, and its vertices move to where the model's are.
// usage: node morph_three.mjs NODE_MODULES FOLDER
import fs from 'node:fs';
import path from 'node:path';
import { pathToFileURL } from 'node:url';

const [modules, folder] = process.argv.slice(2);
const three = path.join(path.resolve(modules), 'three');
if (!fs.existsSync(three)) {
  console.log(`skipped: no three in ${modules}; run tests/run, which fetches it`);
  process.exit(77);
}
globalThis.self = globalThis; // the loader expects a browser's global object
// The loader imports 'three' by name: let its folder be found whatever it is called.
const { register } = await import('node:module');
register('data:text/javascript,' + encodeURIComponent(`
  export const resolve = (name, context, next) => name === 'three'
    ? { url: ${JSON.stringify(pathToFileURL(path.join(three, 'build', 'three.module.js')).href)}, shortCircuit: true }
    : next(name, context);`));
const THREE = await import('three');
const { GLTFLoader } = await import(pathToFileURL(path.join(three, 'examples/jsm/loaders/GLTFLoader.js')).href);

const expected = JSON.parse(fs.readFileSync(path.join(folder, 'face.json')));
const weights = { [expected.blendshape]: expected.weight, 'expression mean': 1 };
expected.shape.forEach((c, k) => { weights[`shape ${k + 1}`] = c; });
expected.expression.forEach((c, k) => { weights[`expression ${k + 1}`] = c; });

for (const name of ['coloured.glb', 'textured.glb']) {
  const bytes = fs.readFileSync(path.join(folder, name));
  const buffer = bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length);
  const gltf = await new GLTFLoader().parseAsync(buffer, '');
  let mesh;
  gltf.scene.traverse((object) => { if (object.isMesh) mesh = object; });
  const names = Object.keys(mesh.morphTargetDictionary);
  for (const [target, weight] of Object.entries(weights)) {
    if (!(target in mesh.morphTargetDictionary)) throw new Error(`${name}: no morph target '${target}' in ${names}`);
    mesh.morphTargetInfluences[mesh.morphTargetDictionary[target]] = weight;
  }
  const rest = mesh.geometry.attributes.position, p = new THREE.Vector3();
  let worst = 0, moved = 0;
  for (let v = 0; v < rest.count; ++v) {
    mesh.getVertexPosition(v, p);
    const want = new THREE.Vector3(...expected.face_mm.slice(3 * v, 3 * v + 3)).multiplyScalar(1e-3);
    worst = Math.max(worst, p.distanceTo(want));
    moved = Math.max(moved, p.distanceTo(new THREE.Vector3().fromBufferAttribute(rest, v)));
  }
  console.log(`${name}: ${names.length} morph targets (${names.join(', ')}); moved up to ${(moved * 1e3).toFixed(2)} mm, ` +
    `off by at most ${(worst * 1e3).toExponential(1)} mm`);
  if (!(worst < 1e-6) || !(moved > 1e-3)) process.exitCode = 1;
}
