// The handle on the surface: arrows along x, y and z, a ball for x and y, a ring for the yaw.

const {THREE} = MeshCat;

const COLOURS = [0xd91a1a, 0x1aa61a, 0x1a33e6];
const RING = 0x7a3fb8, BALL = 0x222a33, HELD = 0xffa31a;
const AXES = [new THREE.Vector3(1, 0, 0), new THREE.Vector3(0, 1, 0), new THREE.Vector3(0, 0, 1)];
const LEVEL = 0.2; // [1] of a line of sight's slope, below which the ball moves square to it
const SHARE = 0.11; // of the distance to the camera: the handle looks equally large everywhere

function part(name, geometry, colour) {
  const material = new THREE.MeshBasicMaterial({color: colour, depthTest: false,
    depthWrite: false, transparent: true, opacity: 0.9});
  const mesh = new THREE.Mesh(geometry, material);
  Object.assign(mesh, {name, renderOrder: 10});
  mesh.userData.colour = colour;
  return mesh;
}

// What is grasped is thicker than what is seen.
function grip(name, geometry) {
  const mesh = new THREE.Mesh(geometry, new THREE.MeshBasicMaterial());
  mesh.name = name;
  mesh.material.visible = false;
  return mesh;
}

export class Handle {
  constructor(viewer, pane, group, radius) {
    Object.assign(this, {viewer, pane, group});
    this.moved = () => {};
    this.held = null;
    this.body = new THREE.Group();
    group.add(this.body);
    this.parts = {};
    this.grips = [];
    ["x", "y", "z"].forEach((name, k) => this.arrow(name, k));
    this.add("level", new THREE.SphereGeometry(0.13, 24, 16), new THREE.SphereGeometry(0.2, 12, 8),
      BALL);
    this.add("yaw", new THREE.TorusGeometry(0.62, 0.028, 8, 64),
      new THREE.TorusGeometry(0.62, 0.09, 6, 32), RING);
    this.raycaster = new THREE.Raycaster();
    pane.addEventListener("pointerdown", (event) => this.take(event), true);
    window.addEventListener("pointermove", (event) => this.follow(event));
    window.addEventListener("pointerup", (event) => this.release(event));
    window.addEventListener("pointercancel", (event) => this.release(event));
    viewer.controls.addEventListener("change", () => this.fit());
  }

  arrow(name, k) {
    const turn = new THREE.Quaternion().setFromUnitVectors(AXES[1], AXES[k]);
    const rod = new THREE.CylinderGeometry(0.025, 0.025, 0.8, 12).translate(0, 0.4, 0);
    const tip = new THREE.ConeGeometry(0.085, 0.25, 20).translate(0, 0.92, 0);
    const wide = new THREE.CylinderGeometry(0.11, 0.11, 0.9, 8).translate(0, 0.62, 0);
    this.add(name, rod.applyQuaternion(turn), wide.applyQuaternion(turn), COLOURS[k]);
    this.add(name, tip.applyQuaternion(turn), null, COLOURS[k]);
  }

  add(name, seen, wide, colour) {
    const mesh = part(name, seen, colour);
    (this.parts[name] = this.parts[name] || []).push(mesh);
    this.body.add(mesh);
    if (wide !== null) {
      const hold = grip(name, wide);
      this.grips.push(hold);
      this.body.add(hold);
    }
  }

  // Put it at a point (m) of the root frame.
  place(centre) {
    this.body.position.copy(centre);
    this.fit();
  }

  // Keep its size on the screen.
  fit() {
    const eye = this.viewer.camera.getWorldPosition(new THREE.Vector3());
    const here = this.body.getWorldPosition(new THREE.Vector3());
    this.body.scale.setScalar(Math.max(SHARE * eye.distanceTo(here), 1e-3));
    this.viewer.set_dirty();
  }

  // The ray under the pointer, in the frame of the group.
  ray(event) {
    const box = this.pane.getBoundingClientRect();
    const x = 2 * (event.clientX - box.left) / box.width - 1;
    const y = 1 - 2 * (event.clientY - box.top) / box.height;
    this.viewer.camera.updateMatrixWorld();
    this.raycaster.setFromCamera({x, y}, this.viewer.camera);
    const inverse = new THREE.Matrix4().copy(this.group.matrixWorld).invert();
    return this.raycaster.ray.clone().applyMatrix4(inverse);
  }

  // What is under the pointer; the ball and the arrows before the ring.
  under(event) {
    this.group.updateMatrixWorld(true);
    this.ray(event);
    const hits = this.raycaster.intersectObjects(this.grips).map((hit) => hit.object.name);
    return hits.find((name) => name !== "yaw") || hits[0] || null;
  }

  // Where the pointer is as a number or a point, as the held part moves.
  measure(event) {
    const ray = this.ray(event), {centre, name} = this.held;
    if (name === "level" || name === "yaw") {
      const normal = name === "yaw" ? AXES[2].clone() : this.held.facing;
      const plane = new THREE.Plane().setFromNormalAndCoplanarPoint(normal, centre);
      const point = ray.intersectPlane(plane, new THREE.Vector3());
      if (point === null) return null;
      point.sub(centre);
      return name === "yaw" ? Math.atan2(point.y, point.x) : point;
    }
    // The point of the axis that is nearest to the ray.
    const axis = AXES[["x", "y", "z"].indexOf(name)];
    const between = centre.clone().sub(ray.origin), b = axis.dot(ray.direction);
    const apart = 1 - b * b;
    if (apart < 1e-4) return null; // along the line of sight
    const along = (b * between.dot(ray.direction) - between.dot(axis)) / apart;
    return axis.clone().multiplyScalar(along);
  }

  take(event) {
    const name = event.button === 0 ? this.under(event) : null;
    if (name === null) return;
    event.preventDefault();
    const sight = this.ray(event).direction;
    const facing = Math.abs(sight.z) > LEVEL ? AXES[2].clone() : sight.clone().negate();
    this.held = {name, facing, centre: this.body.position.clone(), last: null};
    this.held.begin = this.measure(event);
    if (this.held.begin === null) {
      this.held = null;
      return;
    }
    this.viewer.controls.enabled = false; // the camera stays
    this.pane.classList.add("dragging");
    for (const mesh of this.parts[name]) mesh.material.color.setHex(HELD);
    this.moved("begin", null);
    this.viewer.set_dirty();
  }

  follow(event) {
    if (this.held === null) {
      if (event.buttons === 0 && this.pane.contains(event.target)) {
        this.pane.classList.toggle("handle", this.under(event) !== null);
      }
      return;
    }
    const now = this.measure(event);
    if (now === null) return;
    const {name, begin, centre} = this.held;
    if (name === "yaw") {
      let turn = now - begin;
      turn -= 2 * Math.PI * Math.round(turn / (2 * Math.PI));
      this.moved("turn", {turn, centre});
    } else {
      this.moved("shift", now.clone().sub(begin));
    }
  }

  release(event) {
    if (this.held === null) return;
    for (const mesh of this.parts[this.held.name]) {
      mesh.material.color.setHex(mesh.userData.colour);
    }
    this.held = null;
    this.viewer.controls.enabled = true;
    this.pane.classList.remove("dragging");
    this.moved("end", null);
    this.viewer.set_dirty();
  }
}
