// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// Khronos' glTF validator must find no error, no warning and no hint. Its one remark, on files with colours at the
// vertices: texture coordinates that no texture uses; they stay, for textures of the user's own.
// usage: node validate_gltf.mjs NODE_MODULES FILE...
import fs from 'node:fs';
import { createRequire } from 'node:module';
import path from 'node:path';

const [modules, ...files] = process.argv.slice(2);
const entry = path.join(path.resolve(modules), 'gltf-validator', 'index.js');
if (!fs.existsSync(entry)) {
  console.log(`skipped: no gltf-validator in ${modules}; run tests/run, which fetches it`);
  process.exit(77);
}
const validator = createRequire(import.meta.url)(entry);
for (const file of files) {
  const { issues, info } = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)));
  console.log(`${file}: ${issues.numErrors} errors, ${issues.numWarnings} warnings, ${issues.numInfos} infos, ` +
    `${issues.numHints} hints; ${info.totalVertexCount} vertices, ${info.totalTriangleCount} triangles`);
  for (const m of issues.messages) console.log(`  ${m.code} ${m.pointer}: ${m.message}`);
  if (issues.messages.some((m) => m.code !== 'UNUSED_OBJECT' || !m.pointer.endsWith('TEXCOORD_0'))) process.exitCode = 1;
}
