// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// Landmarks, name to [x, y, z], with every change undone and redone.

export class Landmarks {
  #at = new Map();
  #done = [];
  #undone = [];
  #saved = 0; // length of #done when last saved; -1 if that is no longer to be reached

  constructor(positions) {
    for (const [name, x] of Object.entries(positions)) this.#at.set(name, x);
  }
  get(name) { return this.#at.get(name); }
  has(name) { return this.#at.has(name); }
  get names() { return [...this.#at.keys()]; }
  get changed() { return this.#done.length !== this.#saved; }
  get canUndo() { return this.#done.length > 0; }
  get canRedo() { return this.#undone.length > 0; }
  toJSON() { return Object.fromEntries(this.#at); }

  // A landmark at a place, or nowhere.
  put(name, after) {
    const before = this.#at.get(name);
    if (!before && !after) return;
    if (this.#saved > this.#done.length) this.#saved = -1;
    this.#undone = [];
    this.#done.push({ name, before, after });
    this.#apply(name, after);
  }
  undo() {
    const change = this.#done.pop();
    if (!change) return null;
    this.#undone.push(change);
    this.#apply(change.name, change.before);
    return change.name;
  }
  redo() {
    const change = this.#undone.pop();
    if (!change) return null;
    this.#done.push(change);
    this.#apply(change.name, change.after);
    return change.name;
  }
  markSaved() { this.#saved = this.#done.length; }
  #apply(name, place) {
    if (place) this.#at.set(name, place);
    else this.#at.delete(name);
  }
}
