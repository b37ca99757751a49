// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// The face in three dimensions: three.js, drawn only when something has changed.
import {
  BufferAttribute, BufferGeometry, Color, DirectionalLight, DoubleSide, HemisphereLight, Mesh, MeshBasicMaterial,
  MeshLambertMaterial, PerspectiveCamera, Points, PointsMaterial, Scene, SRGBColorSpace, Texture, Vector3, WebGLRenderer,
} from 'three';
import { OrbitControls } from 'three/examples/jsm/controls/OrbitControls.js';

const mapSize = 200; // millimetres that the flattened texture map is shown wide
const restRatio = 2; // pixels drawn for each one shown when nothing moves: smooths edges
const restAfter = 180; // milliseconds
const slowFrame = 36; // milliseconds: while it moves, slower pictures are drawn coarser

export class Stage {
  constructor(canvas, face, textureImage) {
    this.canvas = canvas;
    this.face = face;
    this.renderer = new WebGLRenderer({ canvas, alpha: true });
    this.ratio = this.movingRatio = 1;
    this.lastFrame = 0;
    this.scene = new Scene();
    this.camera = new PerspectiveCamera(24, 1, 10, 4000);
    const lamp = new DirectionalLight(0xffffff, 2.1);
    lamp.position.set(-0.35, 0.55, 1);
    this.camera.add(lamp, lamp.target);
    lamp.target.position.set(0, 0, -1);
    this.scene.add(this.camera, new HemisphereLight(0xffffff, 0x9a9088, 1.25));
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.addEventListener('change', () => this.touch());
    // The light of its picture is in a texture already.
    this.options = { grey: !face.coloured && !textureImage, wireframe: false, map: false, landmarks: false, unlit: Boolean(textureImage) };
    this.makeMaterials(textureImage);
    this.geometry = new BufferGeometry();
    this.mesh = new Mesh(this.geometry, this.materials.grey);
    this.dots = new Points(new BufferGeometry(), new PointsMaterial({ color: 0x1670e0, size: 7, sizeAttenuation: false }));
    this.dots.visible = false;
    this.scene.add(this.mesh, this.dots);
    this.setLevel();
    this.centre = this.middle();
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
    this.resize();
    this.look('front');
  }

  makeMaterials(textureImage) {
    const own = { side: DoubleSide, vertexColors: this.face.coloured };
    if (textureImage) {
      own.map = new Texture(textureImage);
      own.map.colorSpace = SRGBColorSpace;
      own.map.anisotropy = 4;
      own.map.needsUpdate = true;
    }
    this.materials = {
      coloured: new MeshLambertMaterial(own),
      grey: new MeshLambertMaterial({ color: new Color(0xb8b2ab), side: DoubleSide }),
      flat: new MeshBasicMaterial(own),
      lines: new MeshBasicMaterial({ color: 0x3a6ea8, wireframe: true }),
    };
  }

  middle() {
    this.geometry.computeBoundingBox();
    this.size = this.geometry.boundingBox.getSize(new Vector3());
    return this.geometry.boundingBox.getCenter(new Vector3());
  }

  // Buffers of the face's level, which share its memory.
  setLevel() {
    const { face } = this;
    const attribute = (array, width) => {
      const made = new BufferAttribute(array.subarray(0, (face.size / 3) * width), width);
      made.needsUpdate = true;
      return made;
    };
    this.geometry.dispose();
    this.geometry = new BufferGeometry();
    this.mapped = face.uv && this.options.map ? this.flattened() : null;
    this.geometry.setIndex(new BufferAttribute(face.faces, 1));
    this.geometry.setAttribute('position', attribute(this.mapped ?? face.positions, 3));
    this.geometry.setAttribute('normal', attribute(face.normals, 3));
    if (face.coloured) this.geometry.setAttribute('color', attribute(face.colours, 3));
    if (face.uv) this.geometry.setAttribute('uv', attribute(face.uv, 2));
    this.mesh.geometry = this.geometry;
    this.mesh.frustumCulled = false;
    this.showLandmarks();
    this.touch();
  }

  flattened() {
    const out = new Float32Array(this.face.positions.length);
    for (let i = 0; 2 * i < this.face.uv.length; ++i) {
      out[3 * i] = (this.face.uv[2 * i] - 0.5) * mapSize;
      out[3 * i + 1] = (this.face.uv[2 * i + 1] - 0.5) * mapSize;
    }
    return out;
  }

  // After face.update().
  refresh() {
    for (const name of ['position', 'normal', 'color']) {
      const attribute = this.geometry.getAttribute(name);
      if (attribute) attribute.needsUpdate = true;
    }
    this.showLandmarks();
    this.touch();
  }

  showLandmarks() {
    this.dots.visible = this.options.landmarks && !this.options.map;
    if (!this.dots.visible) return;
    const places = this.face.landmarkPositions();
    const towards = this.camera.position.clone().normalize();
    for (let i = 0; i < places.length; i += 3) { // off the skin, so that it does not hide them
      places[i] += towards.x; places[i + 1] += towards.y; places[i + 2] += towards.z;
    }
    this.dots.geometry.setAttribute('position', new BufferAttribute(places, 3));
    this.dots.geometry.computeBoundingSphere();
  }

  set(option, on) {
    const turned = option === 'map' && this.options.map !== on;
    this.options[option] = on;
    if (turned) {
      this.setLevel();
      this.look('front');
    }
    this.showLandmarks();
    this.touch();
  }

  look(from) {
    const directions = { front: [0, 0, 1], left: [1, 0, 0.15], right: [-1, 0, 0.15], half: [0.75, 0.1, 1] };
    const towards = new Vector3(...directions[from]).normalize();
    const target = this.options.map ? new Vector3() : this.centre;
    const extent = this.options.map ? new Vector3(mapSize, mapSize, 0) : this.size;
    const half = Math.tan((this.camera.fov * Math.PI) / 360);
    const distance = Math.max(extent.y, Math.max(extent.x, extent.z) / this.camera.aspect) * (0.54 / half) + extent.z / 2;
    this.controls.target.copy(target);
    this.camera.position.copy(target).addScaledVector(towards, distance);
    this.controls.update();
    this.touch();
  }

  turn(angle) {
    const arm = this.camera.position.clone().sub(this.controls.target).applyAxisAngle(new Vector3(0, 1, 0), angle);
    this.camera.position.copy(this.controls.target).add(arm);
    this.controls.update();
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas.parentElement;
    if (width === 0 || height === 0) return;
    this.renderer.setPixelRatio(this.ratio);
    this.renderer.setSize(width, height, false);
    const was = this.camera.aspect;
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    if (Math.min(1, was) !== Math.min(1, this.camera.aspect)) this.look('front');
    this.touch();
  }

  // Something has changed: a quick picture now, a fine one when it rests.
  touch() {
    clearTimeout(this.resting);
    this.resting = setTimeout(() => this.drawFine(), restAfter);
    if (!this.pending) this.pending = requestAnimationFrame((now) => this.drawMoving(now));
  }
  drawMoving(now) {
    const took = now - this.lastFrame;
    this.lastFrame = now;
    if (took < 4 * slowFrame) { // else it has only begun to move
      this.slow = 0.7 * (this.slow ?? 0) + 0.3 * took;
      if (this.slow > slowFrame && this.movingRatio > 0.5) {
        this.movingRatio *= 0.8;
        this.slow = 0;
      }
    }
    this.drawAt(this.movingRatio);
  }
  drawFine() { this.drawAt(Math.max(restRatio, Math.min(3, window.devicePixelRatio))); }
  drawAt(ratio) {
    if (ratio !== this.ratio) {
      this.ratio = ratio;
      this.renderer.setPixelRatio(ratio); // sets the size anew
    }
    this.draw();
  }
  draw() {
    this.pending = 0;
    const { grey, wireframe, map, unlit } = this.options;
    this.mesh.material = this.materials[wireframe ? 'lines' : grey ? 'grey' : map || unlit ? 'flat' : 'coloured'];
    this.renderer.render(this.scene, this.camera);
    this.frames = (this.frames ?? 0) + 1;
  }

  // What is shown, as a PNG.
  picture() {
    this.drawFine();
    return new Promise((done) => this.canvas.toBlob(done, 'image/png'));
  }
  // Index of the landmark shown within `reach` pixels of the canvas, or -1.
  landmarkAt(x, y, reach = 8) {
    if (!this.dots.visible) return -1;
    const places = this.dots.geometry.getAttribute('position');
    let best = -1, least = reach;
    for (let i = 0; i < places.count; ++i) {
      const p = new Vector3().fromBufferAttribute(places, i).project(this.camera);
      const away = Math.hypot(((p.x + 1) / 2) * this.canvas.clientWidth - x, ((1 - p.y) / 2) * this.canvas.clientHeight - y);
      if (away < least) [best, least] = [i, away];
    }
    return best;
  }
}
