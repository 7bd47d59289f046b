// The panel: sliders and numbers, in millimetres and degrees.

const AXES = ["x", "y", "z"];
const ANGLES = ["roll", "pitch", "yaw"];
const FREE = 360; // degrees that the sliders of a joint without limits show

function made(kind, properties, parent) {
  const element = document.createElement(kind);
  const {className, ...rest} = properties;
  if (className) element.className = className;
  for (const [name, value] of Object.entries(rest)) {
    if (name in element) element[name] = value;
    else element.setAttribute(name, value);
  }
  parent.appendChild(element);
  return element;
}

// A slider and a number that show one value.
class Dial {
  constructor(row, {label, id, range, step, moved}) {
    const [low, high] = range;
    const common = {step: "any", "aria-label": label};
    this.slider = made("input", {type: "range", id, min: low, max: high, ...common}, row);
    this.number = made("input", {type: "number", id: `${id}-number`, ...common}, row);
    // Arrow keys go by whole steps from wherever the value is.
    this.slider.addEventListener("keydown", (event) => {
      const counts = {ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1, PageDown: -10,
        PageUp: 10};
      const count = counts[event.key];
      if (count === undefined) return;
      event.preventDefault();
      const next = Number(this.slider.value) + count * step * (event.shiftKey ? 10 : 1);
      moved(Math.min(Math.max(next, low), high), !event.repeat);
      this.pressed = true;
    });
    this.slider.addEventListener("keyup", () => {
      if (this.pressed) moved(Number(this.slider.value), true);
      this.pressed = false;
    });
    const stepped = () => Math.round(Number(this.slider.value) / step) * step;
    this.slider.addEventListener("input", () => moved(stepped(), false));
    this.slider.addEventListener("change", () => moved(stepped(), true));
    this.number.addEventListener("change", () => {
      if (this.number.value !== "") moved(Number(this.number.value), true);
    });
  }

  show(value, text) {
    this.slider.value = value;
    if (document.activeElement !== this.number || Number(this.number.value) !== value) {
      this.number.value = text === undefined ? String(Math.round(value * 1e6) / 1e6) : text;
    }
  }
}

export class Panel {
  // `changed`: called with new values, and whether the change is done with.
  constructor(described, changed) {
    this.described = described;
    this.values = structuredClone(described.values);
    this.changed = changed;
    this.shown = [];
    const {ranges, step} = described;
    AXES.forEach((axis, k) => this.dial("placement", `position-${axis}`, axis, "mm",
      ranges.position[k], step, (v) => v.position[k], (v, value) => { v.position[k] = value; }));
    ANGLES.forEach((angle, k) => this.dial("placement", `rotation-${angle}`, angle, "deg",
      ranges.rpy_deg[k], step, (v) => v.rpy_deg[k], (v, value) => { v.rpy_deg[k] = value; }));
    this.dial("tool", "cone", "cone", "deg", ranges.cone_deg, step, (v) => v.cone_deg,
      (v, value) => { v.cone_deg = value; });
    this.dial("tool", "standoff", "standoff", "mm", ranges.standoff, step, (v) => v.standoff,
      (v, value) => { v.standoff = value; });
    described.joints.forEach((joint, k) => this.limits(joint, k));
    this.show(this.values);
  }

  // One value with a slider of its own.
  dial(place, id, label, unit, range, step, read, write) {
    const row = made("div", {className: "control"}, document.getElementById(place));
    made("label", {htmlFor: id, textContent: label}, row);
    const moved = (value, done) => this.change((values) => write(values, value), done);
    const dial = new Dial(row, {label: `${label} (${unit})`, id, range, step, moved});
    made("span", {className: "unit", textContent: unit}, row);
    this.shown.push((values) => dial.show(read(values)));
  }

  // The two limits of a joint.
  limits(joint, k) {
    const row = made("div", {className: "control joint"}, document.getElementById("limits"));
    made("span", {className: "name", textContent: joint.name, title: joint.name}, row);
    const pair = made("div", {className: "pair"}, row);
    const ends = ["low", "high"].map((end, side) => {
      const label = `${end === "low" ? "lower" : "upper"} limit of ${joint.name}`;
      const moved = (value, done) => this.change((values) => {
        const limits = values.limits[joint.name] || [-FREE, FREE];
        limits[side] = value;
        values.limits[joint.name] = limits;
      }, done);
      return new Dial(row, {label: `${label} (${joint.unit})`, id: `limit-${k}-${end}`,
        range: joint.range, step: this.described.step, moved});
    });
    pair.append(ends[0].slider, ends[1].slider);
    made("span", {className: "unit", textContent: joint.unit}, row);
    this.shown.push((values) => {
      const limits = values.limits[joint.name];
      ends.forEach((dial, side) => {
        if (limits) dial.show(limits[side]);
        else dial.show(side ? FREE : -FREE, "");
        dial.number.placeholder = limits ? "" : "free";
      });
    });
  }

  // Change some values, and report them.
  change(write, done) {
    const values = structuredClone(this.values);
    write(values);
    this.show(values);
    this.changed(values, done);
  }

  show(values) {
    this.values = values;
    for (const one of this.shown) one(values);
  }
}
