// The picture: meshcat's viewer, the cells that change colour, and the motion. `run`, `look`,
// `names`, `show` and `seek` are those of every page, in picture.js.

import {Handle} from "./handle.js";

const {THREE} = MeshCat;

function bytes(text) {
  return Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
}

// A frame at a position (m) with fixed-axis roll, pitch and yaw (degrees).
export function frame(position, rpy) {
  const turns = rpy.map(THREE.MathUtils.degToRad);
  const matrix = new THREE.Matrix4().makeRotationFromEuler(new THREE.Euler(...turns, "ZYX"));
  return matrix.setPosition(...position);
}

export class Scene {
  constructor(pane, described, commands) {
    this.viewer = new MeshCat.Viewer(pane);
    this.described = described;
    this.run(commands);
    look(this.viewer, described.camera);
    const rows = described.rotation;
    this.first = new THREE.Matrix4().set(...rows[0], 0, ...rows[1], 0, ...rows[2], 0, 0, 0, 0, 1);
    this.first.setPosition(...described.position);
    this.surface = this.group("/surface");
    this.cells = this.painted(described.cells);
    this.surface.add(this.cells);
    this.handle = new Handle(this.viewer, pane, this.group("/handle"), this.radius());
    this.extra = [];
    this.end = 0;
  }

  group(path) {
    return this.viewer.scene_tree.find(names(this.described.group + path)).object;
  }

  run(commands) {
    run(this.viewer, commands);
    this.lighten();
  }

  // Light falls on corners, not on every pixel: half the work where no graphics card does it.
  lighten() {
    this.viewer.scene.traverse((drawn) => {
      if (!drawn.isMesh || drawn.material.type !== "MeshPhongMaterial") return;
      const heavy = drawn.material;
      drawn.material = new THREE.MeshLambertMaterial().copy(heavy);
      heavy.dispose();
    });
  }

  // All cells as one mesh with a colour at each corner.
  painted({positions, corners, owners}) {
    const geometry = new THREE.BufferGeometry();
    const places = new Float32Array(bytes(positions).buffer);
    this.owners = new Uint32Array(bytes(owners).buffer);
    geometry.setAttribute("position", new THREE.BufferAttribute(places, 3));
    const colours = new Float32Array(places.length).fill(0.75);
    geometry.setAttribute("color", new THREE.BufferAttribute(colours, 3));
    geometry.setIndex(new THREE.BufferAttribute(new Uint32Array(bytes(corners).buffer), 1));
    const material = new THREE.MeshBasicMaterial({vertexColors: true, transparent: true,
      opacity: 0.85, side: THREE.DoubleSide});
    return new THREE.Mesh(geometry, material);
  }

  // Half the extent of the surface, m.
  radius() {
    this.cells.geometry.computeBoundingSphere();
    return this.cells.geometry.boundingSphere.radius;
  }

  // Colour the cells: entries of the legend, and which of them each cell is of.
  paint({classes, entries}, pale) {
    const white = new THREE.Color(1, 1, 1);
    const colours = entries.map((entry) => {
      const colour = new THREE.Color(entry.colour);
      return pale ? colour.lerp(white, 0.35) : colour;
    });
    const attribute = this.cells.geometry.getAttribute("color");
    this.owners.forEach((cell, k) => {
      const colour = colours[classes[cell]];
      attribute.setXYZ(k, colour.r, colour.g, colour.b);
    });
    attribute.needsUpdate = true;
    this.viewer.set_dirty();
  }

  // The colours of all cells as they are now, as #rrggbb.
  colours() {
    const attribute = this.cells.geometry.getAttribute("color"), found = [];
    this.owners.forEach((cell, k) => {
      const colour = new THREE.Color(attribute.getX(k), attribute.getY(k), attribute.getZ(k));
      found[cell] = `#${colour.getHexString()}`;
    });
    return found;
  }

  // Move the surface, and the handle with it, to where the values say.
  place(values) {
    const metres = values.position.map((value) => value / 1000);
    const moved = frame(metres, values.rpy_deg).multiply(this.first.clone().invert());
    moved.decompose(this.surface.position, this.surface.quaternion, this.surface.scale);
    const centre = new THREE.Vector3(...this.described.centre).applyMatrix4(moved);
    this.handle.place(centre);
    this.viewer.set_dirty();
  }

  // Take away what is true of one answer alone.
  clear() {
    this.pause();
    if (this.end > 0) this.viewer.animator.clear();
    this.end = 0;
    for (const path of this.extra) this.viewer.delete_path(names(path));
    this.extra = [];
    this.viewer.set_dirty();
  }

  // Draw what comes with an answer.
  draw(answer) {
    this.clear();
    this.run(bytes(answer.commands));
    this.extra = answer.parts.paths;
    this.end = answer.parts.seconds;
    for (const entry of answer.parts.entries) this.show(entry.path, entry.shown);
    this.paint(answer.paint, answer.kind === "quick");
  }

  show(path, visible) {
    if (path !== null) show(this.viewer, path, visible);
  }

  // -- the motion ------------------------------------------------------------------------------

  play() {
    this.viewer.animator.play();
  }

  pause() {
    if (this.viewer.animator.playing) this.viewer.animator.pause();
  }

  seek(time) {
    seek(this.viewer.animator, time);
  }

  get time() {
    const action = this.viewer.animator.actions[0];
    return action ? action.time : 0;
  }
}
