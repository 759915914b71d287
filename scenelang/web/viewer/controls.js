import { plainNumber } from "./camera.js";
import { copyButton, element, isolated, plainText } from "./dom.js";

const SHOWN_UNITS = { // how many are one of the base unit, and the sign
  deg: [180 / Math.PI, "°"], rad: [1, "rad"], turn: [0.5 / Math.PI, "turn"], s: [1, "s"], ms: [1000, "ms"],
};

/** A control for each of a viewer's params, those that stay fixed with the reason, and a button to reset all. */
export function paramControls(viewer) {
  const { params, fixed } = viewer.view;
  const still = new Set(fixed.map(({ name }) => name));
  const rows = params.filter(({ name }) => !still.has(name)).map((param) => paramRow(viewer, param));
  const unwatch = viewer.watch(({ kind }) => {
    if (kind === "param" || kind === "view") for (const row of rows) row.refresh();
  });
  const reset = element("button", { type: "button", onclick: () => viewer.reset() }, "Reset");
  const fixtures = fixed.map(({ name, reason }) =>
    element("p", { class: "fixed" }, isolated(name), " is fixed: ", isolated(reason)),
  );
  const box = element("div", { class: "params" }, ...rows.map((row) => row.box));
  if (rows.length) box.append(element("div", { class: "bar" }, reset));
  box.append(...fixtures);
  /** Show beside a control why its value gives no picture; null: it does again. */
  const refuse = (name, reason) => {
    for (const row of rows) row.note(row.name === name ? reason : null);
  };
  return { box, refuse, dispose: unwatch };
}

function paramRow(viewer, param) {
  const id = `param-${param.name}`;
  const note = element("output", { class: "why", htmlFor: id });
  const change = (value) => viewer.set(param.name, value);
  const { inputs, sign = "", refresh } = makerOf(param)(param, change);
  inputs[0].id = id;
  for (const input of inputs.slice(1)) input.ariaLabel = plainText(param.name);
  const label = element("label", { for: id }, isolated(param.name));
  const box = element("div", { class: "param" }, label, element("span", { class: "inputs" }, ...inputs, sign), note);
  if (param.label) note.before(element("small", { class: "hint", dir: "auto" }, plainText(param.label)));
  refresh(viewer.params[param.name]);
  return {
    name: param.name,
    box,
    refresh: () => refresh(viewer.params[param.name]),
    note: (reason) => (note.textContent = reason === null ? "" : plainText(reason)),
  };
}

function makerOf(param) {
  if (param.choices) return choiceInput;
  if (["number", "angle", "time"].includes(param.kind)) return numberInput;
  return { bool: switchInput, color: colourInput, string: textInput }[param.kind] ?? listInput;
}

function numberInput({ unit, low, high, step, exclusive }, change) {
  const [factor, sign] = SHOWN_UNITS[unit] ?? [1, ""];
  step = step && Math.abs(step);
  const told = (value) => plainNumber(value * factor, 6);
  const ranged = low !== undefined && high !== undefined;
  const limits = ranged ? { min: told(low), max: told(high) } : {};
  const steps = { step: step ? told(step) : "any" };
  const clamped = (value) => {
    if (!ranged) return value;
    const whole = step ? low + Math.round((value - low) / step) * step : value;
    const last = step ? Math.floor((high - low) / step + 1e-9) * step + low : high;
    const top = exclusive && last >= high - 1e-9 ? last - (step || 1e-6 * (high - low)) : last;
    return Math.max(low, Math.min(top, whole));
  };
  const take = (input) => () => {
    const value = input.valueAsNumber / factor;
    if (Number.isFinite(value)) change(clamped(value));
  };
  const slider = element("input", { type: "range", ...limits, ...steps });
  const box = element("input", { type: "number", ...limits, step: "any" });
  slider.addEventListener("input", take(slider));
  box.addEventListener("change", take(box));
  return { inputs: ranged ? [slider, box] : [box], sign, refresh: (value) => (slider.value = box.value = told(value)) };
}

function switchInput(_, change) {
  const input = element("input", { type: "checkbox", role: "switch", onchange: () => change(input.checked) });
  return { inputs: [input], refresh: (value) => (input.checked = value) };
}

function colourInput(_, change) {
  const input = element("input", { type: "color" });
  const hex = (value) => Math.round(255 * Math.max(0, Math.min(1, value))).toString(16).padStart(2, "0");
  input.addEventListener("input", () =>
    change([1, 3, 5].map((at) => parseInt(input.value.slice(at, at + 2), 16) / 255)),
  );
  return { inputs: [input], refresh: (value) => (input.value = `#${[...value].map(hex).join("")}`) };
}

function choiceInput({ choices }, change) {
  const options = choices.map((value, at) => element("option", { value: at }, plainText(asText(value))));
  const input = element("select", { onchange: () => change(choices[input.value]) }, ...options);
  const place = (value) => choices.findIndex((choice) => asText(choice) === asText(value));
  return { inputs: [input], refresh: (value) => (input.value = place(value)) };
}

function textInput(_, change) {
  const input = element("input", { type: "text", dir: "auto", onchange: () => change(input.value) });
  return { inputs: [input], refresh: (value) => (input.value = value) };
}

/** Vectors, nested ones too, as text in brackets. */
function listInput(_, change) {
  const input = element("input", { type: "text", spellcheck: false });
  input.addEventListener("change", () => {
    let value;
    try {
      value = JSON.parse(input.value);
    } catch {
      value = null;
    }
    input.setCustomValidity(Array.isArray(value) ? "" : "numbers in brackets, such as [1, 2.5]");
    if (input.reportValidity()) change(value);
  });
  return { inputs: [input], refresh: (value) => (input.value = asText(value)) };
}

function asText(value) {
  if (typeof value === "string") return value;
  const within = (item) => (typeof item === "string" ? JSON.stringify(item) : asText(item));
  if (Array.isArray(value)) return `[${value.map(within).join(", ")}]`;
  return typeof value === "number" ? plainNumber(value, 6) : String(value);
}

/** Play, pause and scrub an animation. */
export function timeline(viewer) {
  const button = element("button", { type: "button", class: "play" });
  const place = element("input", { type: "range", min: 0, step: 1, class: "time", "aria-label": "Frame" });
  const time = element("output", { class: "seconds" });
  button.addEventListener("click", () => (viewer.playing ? viewer.pause() : viewer.play()));
  place.addEventListener("input", () => {
    const frame = place.valueAsNumber; // a pause shows the one before
    viewer.pause();
    viewer.seek(frame);
  });
  const refresh = () => {
    const { fps = 1, seconds = 0 } = viewer.view.animation ?? {};
    place.max = viewer.frames - 1;
    place.value = viewer.frame;
    time.textContent = `${(viewer.frame / fps).toFixed(2)} / ${plainNumber(seconds, 2)} s`;
    place.setAttribute("aria-valuetext", `${(viewer.frame / fps).toFixed(2)} seconds`);
    button.textContent = viewer.playing ? "Pause" : "Play";
  };
  const unwatch = viewer.watch(({ kind }) => {
    if (kind === "frame" || kind === "play" || kind === "view") refresh();
  });
  refresh();
  return { box: element("div", { class: "bar timeline" }, button, place, time), dispose: unwatch };
}

const HINT = "Drag to turn the picture, with Shift to move it; pinch, or press + and -, to zoom.";

/** The camera's line with a button to copy it, and one to go back to the scene's own. */
export function cameraControls(viewer) {
  const line = element("span", { class: "line" });
  const back = element("button", { type: "button", onclick: () => (viewer.camera = null) }, "Reset camera");
  const copy = copyButton("Copy camera line", () => viewer.cameraLine());
  const refresh = () => {
    line.replaceChildren(viewer.moved ? element("code", {}, viewer.cameraLine()) : HINT);
    back.disabled = !viewer.moved;
  };
  const unwatch = viewer.watch(({ kind }) => {
    if (kind === "camera" || kind === "view") refresh();
  });
  refresh();
  return { box: element("div", { class: "bar camera" }, back, copy, line), dispose: unwatch };
}
