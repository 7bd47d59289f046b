// The page of a view: the legend switches parts, the slider goes through the motion.

async function unpacked(id) {
  const text = atob(document.getElementById(id).textContent);
  const bytes = Uint8Array.from(text, (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return await new Response(stream).arrayBuffer();
}

function legend(viewer) {
  for (const box of document.querySelectorAll("#legend label input")) {
    box.onchange = () => show(viewer, box.dataset.path, box.checked);
  }
}

function player(viewer, readout, begin) {
  const animator = viewer.animator, end = readout.times[readout.times.length - 1];
  const [button, slider, seconds] = ["pause", "time", "seconds"].map(
    (id) => document.getElementById(id));
  const cells = [...document.querySelectorAll("#readout tr")].map((row) => row.cells[1]);
  const near = document.getElementById("nearest");
  const digits = (unit) => unit === "mm" ? 2 : 1;
  const now = () => {
    const action = animator.actions[0];
    const back = readout.there_and_back && action._loopCount > 0 && action._loopCount % 2 === 1;
    return back ? end - action.time : action.time;
  };
  const read = (time) => {
    const times = readout.times;
    let k = 1;
    while (k < times.length - 1 && times[k] < time) k += 1;
    const span = times[k] - times[k - 1];
    const share = span > 0 ? Math.min(Math.max((time - times[k - 1]) / span, 0), 1) : 1;
    readout.rows.forEach(([, unit, values], row) => {
      const value = values[k - 1] + share * (values[k] - values[k - 1]);
      cells[row].textContent = value.toFixed(digits(unit));
    });
    // A pair is the nearest from its key frame on.
    if (readout.nearest.length > 0)
      near.textContent = "nearest: " + readout.nearest[times[k] <= time ? k : k - 1];
    slider.value = time;
    const share_of_all = end > 0 ? time / end : 0;
    seconds.textContent = readout.duration === null
      ? (100 * share_of_all).toFixed(0) + " %"
      : (share_of_all * readout.duration).toFixed(1) + " s";
  };
  const label = () => { button.textContent = animator.playing ? "pause" : "play"; };
  const move = (time) => {
    seek(animator, time);
    read(time);
  };
  button.onclick = () => {
    if (animator.playing) animator.pause(); else animator.play();
    label();
  };
  slider.oninput = () => {
    if (animator.playing) animator.pause();
    move(Number(slider.value));
    label();
  };
  const follow = () => {
    if (animator.playing) read(now());
    label();
    window.requestAnimationFrame(follow);
  };
  if (animator.playing) read(0); else move(begin);
  follow();
}

async function start() {
  const program = document.createElement("script");
  program.textContent = new TextDecoder().decode(await unpacked("program"));
  document.head.appendChild(program);
  const viewer = new MeshCat.Viewer(document.getElementById("meshcat-pane"));
  run(viewer, new Uint8Array(await unpacked("commands")));
  look(viewer, setup);
  legend(viewer);
  if (readout) player(viewer, readout, setup.start);
  window.viewer = viewer;
}

function complain(error) {
  const note = document.createElement("p");
  note.textContent = "This browser cannot show the scene (it needs WebGL and DecompressionStream, "
    + "as in any browser since 2023): " + error;
  document.getElementById("legend").appendChild(note);
}

// A notebook may hold many scenes: there, each starts when it is first seen. None plays unseen.
let started = false;
let resting = false;
function begin() {
  if (started) return;
  started = true;
  start().catch(complain);
}

if (window.parent === window) begin();
new IntersectionObserver((changes) => {
  const seen = changes[changes.length - 1].isIntersecting;
  if (seen) begin();
  const animator = window.viewer && window.viewer.animator;
  if (!animator || seen !== resting) return;
  if (seen) animator.play();
  else if (animator.playing) animator.pause();
  else return;
  resting = !seen;
}).observe(document.getElementById("meshcat-pane"));
