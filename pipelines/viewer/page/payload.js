// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// The numbers a page carries (viewer_data.h writes them): gzip, in base64, of a header's length in four bytes, the
// header as JSON, and arrays of numbers, each starting at a multiple of four bytes.

const types = { f4: Float32Array, i4: Int32Array, i2: Int16Array, i1: Int8Array, u1: Uint8Array };

export async function readPayload(element) {
  const packed = Uint8Array.from(atob(element.textContent.trim()), (c) => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream('gzip'));
  return parsePayload(await new Response(stream).arrayBuffer());
}

export function parsePayload(bytes) {
  const length = new DataView(bytes).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, 4, length)));
  const start = 4 + length;
  const arrays = {};
  for (const [name, { type, offset, count }] of Object.entries(header.arrays))
    arrays[name] = new types[type](bytes, start + offset, count);
  return { header, arrays };
}
