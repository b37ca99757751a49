// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// The model's arithmetic: coefficients (in standard deviations) to positions in millimetres and linear colours.

// A linear family of vectors: mean + sum of coefficient * step * entry, entries as whole numbers. A mesh has no modes.
class Modes {
  constructor(arrays, name, count) {
    this.mean = arrays[`${name}_mean`] ?? null;
    this.entries = arrays[`${name}_modes`] ?? null;
    this.steps = arrays[`${name}_steps`] ?? null;
    this.count = count;
    this.coefficients = new Float32Array(count);
  }
  // Adds the modes to `out`, which holds leading entries of the vector.
  add(out, size) {
    const stride = this.count > 0 ? this.entries.length / this.count : 0;
    for (let k = 0; k < this.count; ++k) {
      const factor = this.coefficients[k] * this.steps[k];
      if (factor === 0) continue;
      const entries = this.entries.subarray(k * stride, k * stride + size);
      for (let i = 0; i < size; ++i) out[i] += factor * entries[i];
    }
  }
}

export class Face {
  constructor({ header, arrays }) {
    this.header = header;
    this.families = {};
    for (const name of ['shape', 'expression', 'blendshape', 'colour'])
      this.families[name] = new Modes(arrays, name, header.families[name]?.names.length ?? 0);
    this.uv = arrays.uv ?? null;
    this.levels = header.levels.map((level, l) => ({
      vertices: level.vertices, triangles: level.triangles,
      faces: new Uint32Array(arrays[`faces_${l}`]), // as WebGL wants them
      marks: arrays[`marks_${l}`] ?? null, markWeights: arrays[`mark_weights_${l}`] ?? null,
    }));
    const finest = this.levels.length - 1;
    this.positions = new Float32Array(3 * this.levels[finest].vertices);
    this.normals = new Float32Array(this.positions.length);
    this.colours = this.families.colour.mean ? new Float32Array(this.positions.length) : null;
    this.setLevel(finest);
  }

  get coloured() { return this.colours !== null; }
  get landmarkNames() { return this.header.landmarks ?? []; }

  setLevel(l) {
    this.level = l;
    this.size = 3 * this.levels[l].vertices;
    this.update();
  }
  get faces() { return this.levels[this.level].faces; }

  // Makes positions, normals and colours of the level from the coefficients.
  update({ shape = true, colour = true } = {}) {
    if (shape) {
      const out = this.positions;
      out.set(this.families.shape.mean.subarray(0, this.size));
      for (const name of ['shape', 'expression', 'blendshape']) this.families[name].add(out, this.size);
      this.updateNormals();
    }
    if (colour && this.coloured) {
      const out = this.colours;
      out.set(this.families.colour.mean.subarray(0, this.size));
      this.families.colour.add(out, this.size);
      for (let i = 0; i < this.size; ++i) out[i] = Math.min(1, Math.max(0, out[i]));
    }
  }

  // Normals weighted by area.
  updateNormals() {
    const { positions: p, normals: n, faces } = this;
    n.fill(0, 0, this.size);
    for (let f = 0; f < faces.length; f += 3) {
      const a = 3 * faces[f], b = 3 * faces[f + 1], c = 3 * faces[f + 2];
      const ux = p[b] - p[a], uy = p[b + 1] - p[a + 1], uz = p[b + 2] - p[a + 2];
      const vx = p[c] - p[a], vy = p[c + 1] - p[a + 1], vz = p[c + 2] - p[a + 2];
      const x = uy * vz - uz * vy, y = uz * vx - ux * vz, z = ux * vy - uy * vx;
      n[a] += x; n[a + 1] += y; n[a + 2] += z;
      n[b] += x; n[b + 1] += y; n[b + 2] += z;
      n[c] += x; n[c + 1] += y; n[c + 2] += z;
    }
    for (let i = 0; i < this.size; i += 3) {
      const length = Math.sqrt(n[i] * n[i] + n[i + 1] * n[i + 1] + n[i + 2] * n[i + 2]) || 1;
      n[i] /= length; n[i + 1] /= length; n[i + 2] /= length;
    }
  }

  // Places of the landmarks on the level, three numbers each.
  landmarkPositions() {
    const { marks, markWeights } = this.levels[this.level];
    if (!marks) return new Float32Array(0);
    const out = new Float32Array(marks.length);
    for (let i = 0; i < marks.length; i += 3)
      for (let k = 0; k < 3; ++k)
        for (let d = 0; d < 3; ++d) out[i + d] += markWeights[i + k] * this.positions[3 * marks[i + k] + d];
    return out;
  }

  set(family, k, value) { this.families[family].coefficients[k] = value; }
}

// Normal numbers from uniform ones [box1958].
export function normal(uniform = Math.random) {
  return Math.sqrt(-2 * Math.log(1 - uniform())) * Math.cos(2 * Math.PI * uniform());
}
