// What the page of a view and the live page do alike with meshcat's viewer.

// Run drawing commands, each behind its length in four bytes.
function run(viewer, bytes) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  for (let at = 0; at < bytes.byteLength; ) {
    const length = view.getUint32(at, true);
    viewer.handle_command_bytearray(bytes.subarray(at + 4, at + 4 + length));
    at += 4 + length;
  }
}

// Look from the camera's eye at its target, now and whenever the pane has another size.
function look(viewer, camera) {
  // The page's own y axis points up.
  const up = ([x, y, z]) => [x, z, -y];
  viewer.camera.position.set(...up(camera.eye));
  viewer.controls.target.set(...up(camera.target));
  const pane = document.getElementById("meshcat-pane");
  const fit = () => {
    const [width, height] = [pane.clientWidth, pane.clientHeight];
    viewer.camera.zoom = camera.zoom * Math.min(1, width / height);
    viewer.set_3d_pane_size(width, height);
  };
  window.addEventListener("resize", fit);
  fit();
}

// The names along a path of the scene tree.
function names(path) {
  return path.split("/").filter((name) => name.length > 0);
}

function show(viewer, path, visible) {
  viewer.set_property(names(path), "visible", visible);
  viewer.set_dirty();
}

// Put everything that moves to a time, s.
function seek(animator, time) {
  for (const action of animator.actions) action.reset().play();
  animator.seek(time);
}
