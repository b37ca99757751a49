// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// The face that is shown, as files.
import { BufferAttribute, BufferGeometry, Mesh, MeshStandardMaterial, Scene, SRGBColorSpace, Texture } from 'three';
import { GLTFExporter } from 'three/examples/jsm/exporters/GLTFExporter.js';

function srgb(linear) {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * linear ** (1 / 2.4) - 0.055;
}

// Millimetres; colours behind the coordinates, sRGB, as many programs read them.
export function objText(face) {
  const lines = ['# Facewright, millimetres'];
  for (let i = 0; i < face.size; i += 3) {
    const place = [face.positions[i], face.positions[i + 1], face.positions[i + 2]].map((x) => x.toFixed(5));
    const colour = face.coloured ? [0, 1, 2].map((k) => srgb(face.colours[i + k]).toFixed(4)) : [];
    lines.push(['v', ...place, ...colour].join(' '));
  }
  if (face.uv) for (let i = 0; i < face.size / 3; ++i) lines.push(`vt ${face.uv[2 * i].toFixed(6)} ${face.uv[2 * i + 1].toFixed(6)}`);
  for (let f = 0; f < face.faces.length; f += 3) {
    const corners = [0, 1, 2].map((k) => face.faces[f + k] + 1);
    lines.push(`f ${corners.map((v) => (face.uv ? `${v}/${v}` : v)).join(' ')}`);
  }
  return `${lines.join('\n')}\n`;
}

// Binary glTF 2.0, in metres as the format wants.
export async function glbBytes(face, textureImage) {
  const geometry = new BufferGeometry();
  geometry.setIndex(new BufferAttribute(new Uint32Array(face.faces), 1));
  geometry.setAttribute('position', new BufferAttribute(face.positions.slice(0, face.size).map((x) => x / 1000), 3));
  geometry.setAttribute('normal', new BufferAttribute(face.normals.slice(0, face.size), 3));
  const material = new MeshStandardMaterial({ roughness: 0.9, metalness: 0, name: 'skin' });
  if (textureImage && face.uv) {
    // Texture coordinates count from the bottom here, from the top in glTF.
    const uv = Float32Array.from(face.uv, (x, i) => (i % 2 ? 1 - x : x));
    geometry.setAttribute('uv', new BufferAttribute(uv.slice(0, (2 * face.size) / 3), 2));
    material.map = new Texture(textureImage);
    material.map.colorSpace = SRGBColorSpace;
    material.map.flipY = false;
  } else if (face.coloured) {
    geometry.setAttribute('color', new BufferAttribute(face.colours.slice(0, face.size), 3));
    material.vertexColors = true;
  }
  const mesh = new Mesh(geometry, material);
  mesh.name = 'face';
  const scene = new Scene();
  scene.add(mesh);
  return new GLTFExporter().parseAsync(scene, { binary: true });
}

export function save(name, content, type) {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(content instanceof Blob ? content : new Blob([content], { type }));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}
