// A live page: what is changed on it is decided anew, quickly while it is dragged and in full after.

import {Panel} from "./controls.js";
import {Questions} from "./questions.js";
import {Scene} from "./scene.js";

const $ = (id) => document.getElementById(id);
const MOST_UNDONE = 200;

function line(entry, parent, switched) {
  const box = document.createElement(switched ? "label" : "div");
  box.className = "line";
  if (switched) {
    const input = document.createElement("input");
    input.type = "checkbox";
    input.checked = entry.shown;
    input.addEventListener("change", () => switched(input.checked));
    box.appendChild(input);
  }
  const swatch = document.createElement("i");
  swatch.style.background = entry.colour;
  box.append(swatch, entry.label);
  parent.appendChild(box);
}

class Page {
  constructor(described, commands) {
    this.described = described;
    this.scene = new Scene($("meshcat-pane"), described, commands);
    this.panel = new Panel(described.controls, (values, done) => this.change(values, done));
    this.committed = structuredClone(this.panel.values);
    this.before = [];
    this.after = [];
    this.answer = null;
    this.questions = new Questions({
      heard: (answer) => this.hear(answer),
      waits: (said) => this.wait(said),
      broken: (trouble) => {
        $("trouble").hidden = !trouble;
        $("trouble").textContent = trouble;
        if (trouble) $("progress").textContent = "not answered";
      },
    });
    this.scene.handle.moved = (what, how) => this.drag(what, how);
    this.buttons();
    this.player();
    $("case").textContent = `${described.name} · ${described.robot}`;
    document.title = `${described.name} · coverable live`;
    this.note(described.note);
    for (const entry of described.entries) {
      line(entry, $("standing"),
        entry.path && ((visible) => this.scene.show(entry.path, visible)));
    }
    this.scene.place(this.panel.values);
    this.ask(true);
  }

  // -- changes -----------------------------------------------------------------------------------

  change(values, done) {
    this.scene.place(values);
    if (done) this.commit();
    this.ask(done);
  }

  // Remember what was before, for `undo`.
  commit() {
    const values = this.panel.values;
    if (JSON.stringify(values) === JSON.stringify(this.committed)) return;
    this.before.push(this.committed);
    if (this.before.length > MOST_UNDONE) this.before.shift();
    this.after = [];
    this.committed = structuredClone(values);
    this.enable();
  }

  restore(values) {
    this.committed = structuredClone(values);
    this.panel.show(structuredClone(values));
    this.scene.place(values);
    this.enable();
    this.ask(true);
  }

  undo() {
    if (this.before.length === 0) return;
    this.after.push(this.committed);
    this.restore(this.before.pop());
  }

  redo() {
    if (this.after.length === 0) return;
    this.before.push(this.committed);
    this.restore(this.after.pop());
  }

  reset() {
    this.panel.show(structuredClone(this.described.controls.values));
    this.change(this.panel.values, true);
  }

  enable() {
    $("undo").disabled = this.before.length === 0;
    $("redo").disabled = this.after.length === 0;
    const first = JSON.stringify(this.described.controls.values);
    $("reset").disabled = JSON.stringify(this.committed) === first;
  }

  // The handle is dragged: a shift of the surface, m, or a turn about its middle, rad.
  drag(what, how) {
    if (what === "begin") this.grasped = structuredClone(this.panel.values);
    if (what === "end") {
      this.change(this.panel.values, true);
      return;
    }
    if (how === null) return;
    const {position, rpy_deg} = this.grasped;
    this.panel.change((values) => {
      if (what === "shift") {
        values.position = position.map((v, k) => Math.round(v + 1000 * how.getComponent(k)));
        return;
      }
      const degrees = Math.round(2 * 180 / Math.PI * how.turn) / 2;
      const turn = degrees * Math.PI / 180, c = Math.cos(turn), s = Math.sin(turn);
      const [x, y] = [position[0] - 1000 * how.centre.x, position[1] - 1000 * how.centre.y];
      const around = [1000 * how.centre.x + c * x - s * y, 1000 * how.centre.y + s * x + c * y];
      values.position = [...around.map((v) => Math.round(1000 * v) / 1000), position[2]];
      let yaw = rpy_deg[2] + degrees;
      if (Math.abs(yaw) > 180) yaw -= 360 * Math.round(yaw / 360);
      values.rpy_deg = [rpy_deg[0], rpy_deg[1], yaw];
    }, false);
  }

  // -- answers -----------------------------------------------------------------------------------

  ask(final) {
    if (this.answer !== null && this.answer.kind !== "quick") this.scene.clear();
    $("player").hidden = true;
    $("answer").classList.add("waiting");
    $("progress").textContent = final ? "deciding ..." : "let go for the certified answer";
    this.questions.ask(this.panel.values, final);
  }

  // It takes longer: what stood there before was the answer to something else.
  wait(said) {
    if (this.answer === null || this.answer.kind !== "quick") {
      $("answer").className = "waiting";
      $("verdict").textContent = "still deciding ...";
    }
    $("progress").textContent = said || "still deciding ...";
    $("progress").title = said;
  }

  hear(answer) {
    this.answer = answer;
    const quick = answer.kind === "quick";
    const share = quick ? (answer.covered === answer.cells ? "all" : "part") : "";
    $("answer").className = `${answer.kind} ${share}`;
    $("verdict").textContent = quick ? answer.head.replace("quick look: ", "") : answer.head;
    $("badge").hidden = !quick;
    $("progress").textContent = quick ? "let go for the certified answer"
      : answer.evidence ? `certified · ${answer.covered} of ${answer.cells} cells · `
        + `evidence: ${answer.evidence}` : "";
    if (answer.kind === "error") return;
    this.scene.draw(answer);
    this.note(answer.note);
    $("rows").replaceChildren(...answer.rows.map(([name, text]) => {
      const row = document.createElement("tr");
      for (const [kind, said] of [["th", name], ["td", text]]) {
        const cell = document.createElement(kind);
        cell.textContent = said;
        row.appendChild(cell);
      }
      return row;
    }));
    const causes = answer.groups.join("\n");
    $("causes").textContent = causes ? `Not covered:\n${causes}` : "";
    $("painted").replaceChildren();
    $("painted").className = quick ? "quick" : "";
    for (const entry of answer.paint.entries) line(entry, $("painted"));
    $("parts").replaceChildren();
    for (const entry of answer.parts.entries) {
      line(entry, $("parts"), entry.path && ((visible) => this.scene.show(entry.path, visible)));
    }
    $("player").hidden = !(answer.parts.seconds > 0);
    $("time").max = answer.parts.seconds;
    $("time").value = 0;
  }

  note(said) {
    $("note").textContent = said;
    $("note").classList.toggle("unchecked", said === "collisions are not checked");
  }

  // -- buttons -----------------------------------------------------------------------------------

  buttons() {
    for (const name of ["undo", "redo", "reset", "save"]) {
      $(name).addEventListener("click", () => this[name]());
    }
    window.addEventListener("keydown", (event) => {
      if (!(event.ctrlKey || event.metaKey)) return;
      const key = event.key.toLowerCase();
      if (key !== "z" && key !== "y") return;
      event.preventDefault();
      if (key === "y" || event.shiftKey) this.redo();
      else this.undo();
    });
  }

  // The browser keeps the file; it takes another name where there is one of that name already.
  async save() {
    let reply;
    try {
      reply = await this.questions.save(this.panel.values);
    } catch {
      reply = {error: "nobody answers: the program that serves this page has ended"};
    }
    $("trouble").hidden = !reply.error;
    $("trouble").textContent = reply.error || "";
    if (reply.error) return;
    const link = document.createElement("a");
    const name = this.described.name.replace(/^.*\/(?=[^/]+\.toml$)/, "").replace(/\.toml$/, "");
    link.download = `${name.replace(/[^\w.-]+/g, "-")}-live.toml`;
    link.href = URL.createObjectURL(new Blob([reply.toml], {type: "application/toml"}));
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 60000);
  }

  player() {
    const scene = this.scene, play = $("play"), slider = $("time");
    play.addEventListener("click", () => {
      if (scene.viewer.animator.playing) scene.pause();
      else scene.play();
    });
    slider.addEventListener("input", () => {
      scene.pause();
      scene.seek(Number(slider.value));
    });
    const follow = () => {
      const playing = scene.viewer.animator.playing;
      play.textContent = playing ? "pause" : "play";
      if (playing) slider.value = scene.time;
      requestAnimationFrame(follow);
    };
    follow();
  }
}

async function start() {
  const [described, commands] = await Promise.all([
    fetch("case.json").then((reply) => reply.json()),
    fetch("scene").then((reply) => reply.arrayBuffer()),
  ]);
  window.page = new Page(described, new Uint8Array(commands));
}

start().catch((error) => {
  $("verdict").textContent = `This browser cannot show the page (it needs WebGL): ${error}`;
});
