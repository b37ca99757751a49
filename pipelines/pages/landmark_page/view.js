// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// The scan in three dimensions with its landmarks as dots: turning it, pointing at it. Places are in the scan's own
// coordinates; three.js sees them less `centre`, in single precision.
import * as THREE from './three.module.js';
import { TrackballControls } from './TrackballControls.js';

const dotPixels = 9;

function dotTexture() {
  const canvas = document.createElement('canvas');
  canvas.width = canvas.height = 64;
  const c = canvas.getContext('2d');
  c.beginPath();
  c.arc(32, 32, 26, 0, 2 * Math.PI);
  c.fillStyle = '#fff';
  c.fill();
  c.lineWidth = 8;
  c.strokeStyle = '#000';
  c.stroke();
  return new THREE.CanvasTexture(canvas);
}

export class View {
  constructor(canvas) {
    this.canvas = canvas;
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, alpha: true, preserveDrawingBuffer: true });
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(25, 1, 0.1, 1000);
    this.lamp = new THREE.DirectionalLight(0xffffff, 2.2);
    this.lamp.position.set(0.3, 0.5, 1);
    this.camera.add(this.lamp, this.lamp.target);
    this.lamp.target.position.set(0, 0, -1);
    this.ambient = new THREE.AmbientLight(0xffffff, 0.9);
    this.scene.add(this.camera, this.ambient);
    this.controls = new TrackballControls(this.camera, canvas);
    this.controls.staticMoving = true;
    this.controls.rotateSpeed = 2.5;
    this.controls.keys = ['', '', ''];
    this.dots = new THREE.Group();
    this.scene.add(this.dots);
    this.dotTexture = dotTexture();
    this.ray = new THREE.Raycaster();
    this.centre = new THREE.Vector3();
    this.mesh = null;
    this.onFrame = () => {};
    this.stale = true; // drawn only when something has changed
    this.controls.addEventListener('change', () => this.touch());
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
    this.resize();
    const frame = () => {
      requestAnimationFrame(frame);
      this.controls.update();
      if (this.stale) this.draw();
    };
    frame();
  }
  touch() { this.stale = true; }

  resize() {
    const { clientWidth: w, clientHeight: h } = this.canvas.parentElement;
    if (!w || !h) return;
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.renderer.setSize(w, h, false);
    this.camera.aspect = w / h;
    this.camera.updateProjectionMatrix();
    this.controls.handleResize();
    this.touch();
  }

  draw() {
    this.stale = false;
    const size = (2 * dotPixels) / this.canvas.clientHeight * Math.tan((this.camera.fov * Math.PI) / 360);
    for (const dot of this.dots.children) {
      const { place, lift, chosen } = dot.userData;
      dot.scale.setScalar(size * (chosen ? 1.5 : 1));
      dot.position.copy(this.camera.position).sub(place).setLength(lift * this.radius).add(place);
    }
    this.renderer.render(this.scene, this.camera);
    this.onFrame();
  }

  // `about` is what the server says of the scan, `bytes` its mesh, `texture` an image or null.
  show(about, bytes, texture) {
    this.clear();
    const geometry = new THREE.BufferGeometry();
    let at = 0;
    const take = (Type, count) => {
      const values = new Type(bytes, at, count);
      at += Math.ceil(values.byteLength / 4) * 4;
      return values;
    };
    geometry.setAttribute('position', new THREE.BufferAttribute(take(Float32Array, 3 * about.vertices), 3));
    geometry.setIndex(new THREE.BufferAttribute(take(Uint32Array, 3 * about.triangles), 1));
    if (about.colours) {
      const colours = Float32Array.from(take(Uint8Array, 3 * about.vertices), (byte) => {
        const x = byte / 255;
        return x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4;
      });
      geometry.setAttribute('color', new THREE.BufferAttribute(colours, 3));
    }
    if (about.uv) geometry.setAttribute('uv', new THREE.BufferAttribute(take(Float32Array, 2 * about.vertices), 2));
    geometry.computeVertexNormals();
    geometry.computeBoundingSphere();
    this.plain = new THREE.MeshStandardMaterial({ color: 0xb9b4ae, roughness: 0.75, side: THREE.DoubleSide });
    this.coloured = this.plain;
    if (texture) {
      texture.colorSpace = THREE.SRGBColorSpace;
      texture.flipY = true;
      this.coloured = new THREE.MeshStandardMaterial({ map: texture, roughness: 0.9, side: THREE.DoubleSide });
    } else if (about.colours) {
      this.coloured = new THREE.MeshStandardMaterial({ vertexColors: true, roughness: 0.9, side: THREE.DoubleSide });
    }
    this.mesh = new THREE.Mesh(geometry, this.coloured);
    this.scene.add(this.mesh);
    this.centre.set(...about.centre);
    this.radius = geometry.boundingSphere.radius;
    this.camera.near = this.radius / 50;
    this.camera.far = this.radius * 50;
    this.camera.updateProjectionMatrix();
    this.touch();
  }

  clear() {
    if (!this.mesh) return;
    this.scene.remove(this.mesh);
    this.mesh.geometry.dispose();
    for (const material of new Set([this.plain, this.coloured])) {
      material.map?.dispose();
      material.dispose();
    }
    this.mesh = null;
  }

  set shaded(on) {
    if (this.mesh) this.mesh.material = on ? this.plain : this.coloured;
    this.touch();
  }

  // Looks from the direction `from` (of unit length) with `up` upwards at the place `target`, `size` filling the picture.
  look(from, up, target = new THREE.Vector3(), size = 2 * this.radius) {
    const distance = (0.62 * size) / Math.tan((this.camera.fov * Math.PI) / 360) / Math.min(1, this.camera.aspect);
    this.controls.target.copy(target);
    this.camera.position.copy(target).addScaledVector(from, distance);
    this.camera.up.copy(up);
    this.camera.lookAt(target);
    this.controls.update();
    this.touch();
  }
  roll() {
    this.camera.up.applyAxisAngle(this.camera.getWorldDirection(new THREE.Vector3()), Math.PI / 2);
    this.touch();
  }

  local(place) { return new THREE.Vector3(...place).sub(this.centre); }

  showLandmarks(landmarks, chosen) {
    for (const dot of this.dots.children) dot.material.dispose();
    this.dots.clear();
    this.touch();
    for (const name of landmarks.names) {
      for (const behind of [false, true]) {
        const material = new THREE.SpriteMaterial({
          map: this.dotTexture, color: name === chosen ? 0xff8800 : 0x2f9bff, sizeAttenuation: false, depthTest: !behind,
          opacity: behind ? 0.25 : 1, transparent: true, depthWrite: false,
        });
        const dot = new THREE.Sprite(material);
        // Lifted off the surface it lies on, which may be rough.
        dot.userData = { name, place: this.local(landmarks.get(name)), lift: behind ? 0 : 0.02, chosen: name === chosen };
        dot.renderOrder = behind ? 1 : 2;
        this.dots.add(dot);
      }
    }
  }

  // Pixels of the canvas, of a place of the scan; null behind the camera.
  pixelOf(place) {
    const p = this.local(place).project(this.camera);
    if (p.z > 1) return null;
    return { x: ((p.x + 1) / 2) * this.canvas.clientWidth, y: ((1 - p.y) / 2) * this.canvas.clientHeight };
  }
  // The place of the scan at pixels of the canvas, or null.
  placeAt(x, y) {
    if (!this.mesh) return null;
    this.ray.setFromCamera(new THREE.Vector2((2 * x) / this.canvas.clientWidth - 1, 1 - (2 * y) / this.canvas.clientHeight), this.camera);
    const hit = this.ray.intersectObject(this.mesh, false)[0];
    return hit ? hit.point.add(this.centre).toArray() : null;
  }
}

export { THREE };
