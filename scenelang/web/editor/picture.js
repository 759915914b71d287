// The picture: by the shader while something moves, by the server when it rests.
import { Numbers } from "./numbers.js";
import { cameraControls, paramControls, timeline } from "./viewer/controls.js";
import { element, plainText } from "./viewer/dom.js";
import { steer } from "./viewer/steer.js";
import { readView } from "./viewer/store.js";
import { Viewer } from "./viewer/viewer.js";

const REST_MS = 150;  // how long nothing moves before the server draws
const START_MS = 120;  // what the server may take for an edit at least before the shader shows it …
const SLOW_MS = 400;  // … unless the last one took this long
const SHARP_MS = 300;  // how long a picture stands before it is drawn as large as it is shown
const MOST_SHARP_MS = 700;  // what that may take
const NAMES = { network: "network", reference: "exact", difference: "network, exact, difference" };

const total = (ms) => (typeof ms === "number" ? ms : Object.values(ms).reduce((sum, each) => sum + each, 0));

/**
 * @param {Object<string, Element>} at elements: stage, canvas, still, note, told, controls, figures
 * @param {{send: (message: object) => void, oncamera: (line: string) => void}} on
 */
export function makePicture(at, { send, oncamera }) {
  let file = null;
  let viewer = null;
  let drawn = null;  // why the shader cannot draw at all, else null
  let unable = null;  // why it cannot draw this scene, else null
  let by = "network";
  let count = 0;
  let wanted = {};  // by -> id of the last drawing that was asked for
  let asked = {};  // id -> {size, at, params}
  let cost = 0;  // ms that the last edit's picture took to come
  let latest = null;  // what stands for the view that came last
  let expected = false;  // whether a drawing of the text whose view comes next was asked for
  let faulty = false;  // whether the text that was last heard of has mistakes
  let written = false;  // whether the camera stands in the text, whose view has not come
  let mostSide = 1024;
  let controls = null;
  let shows = "none";
  let figuresOpen = false;
  let timers = {};

  const later = (name, act, ms) => {
    clearTimeout(timers[name]);
    timers[name] = setTimeout(act, ms);
  };
  const stop = (...names) => names.forEach((name) => clearTimeout(timers[name]));
  const note = (text) => {
    const reason = drawn ?? unable;
    const shown = text ?? (reason && `The server alone draws: ${reason}`);
    at.note.textContent = shown ?? "";
    at.note.hidden = !shown;
  };
  const isByHand = () => Boolean(viewer?.moved && !written);
  const isLive = () => !drawn && !unable && viewer !== null && (by === "shader" || viewer.playing || isByHand());

  // ---------------------------------------------------------------- the server's pictures

  function moved() {
    const changed = (viewer?.view.params ?? []).filter(
      ({ name, value }) => JSON.stringify(viewer.params[name]) !== JSON.stringify(value),
    );
    return Object.fromEntries(changed.map(({ name }) => [name, viewer.params[name]]));
  }

  function ask(what, size = null) {
    if (file === null || what === "shader") return;
    const id = `${what}-${(count += 1)}`;
    wanted[what] = id;
    const params = moved();
    const entry = { size, at: performance.now(), params: JSON.stringify(params) };
    asked = { ...Object.fromEntries(Object.entries(asked).slice(-8)), [id]: entry };
    send({ kind: "draw", id, file, params, frame: viewer?.frame ?? 0, size, by: what });
  }

  /** Nothing moves for the moment: have the server draw soon. */
  function rest(ms = REST_MS) {
    stop("sharp");
    if (isLive()) stop("rest");
    else later("rest", () => ask(by), ms);
    figuresSoon();
  }

  function figuresSoon() {
    if (figuresOpen) later("figures", () => ask("figures"), 4 * REST_MS);
  }

  /** Draw again as large as the picture is shown, where that takes little. */
  function sharpen(size, ms) {
    const box = at.still.getBoundingClientRect();
    const shown = Math.min(box.width * devicePixelRatio, mostSide);
    const factor = Math.min(shown / size[0], mostSide / size[1]);
    if (factor < 1.1 || total(ms) * factor ** 2 > MOST_SHARP_MS) return;
    later("sharp", () => ask(by, size.map((side) => Math.round(side * factor))), SHARP_MS);
  }

  async function onpicture(message) {
    const known = asked[message.id];
    if (message.id !== wanted[message.by] || message.by !== by || message.file !== file || isLive()) return;
    const image = new Image();
    image.src = `data:image/png;base64,${message.png}`;
    await image.decode();
    if (message.id !== wanted[message.by] || message.by !== by || isLive()) return;
    at.still.src = image.src;
    const [width, height] = message.size;
    at.still.style.setProperty("--ratio", image.naturalWidth / image.naturalHeight);
    at.still.dataset.version = message.version;
    show("still");
    note(null);
    const figures = ["psnr", "ssim", "flip"].filter((name) => typeof message[name] === "number");
    const told = figures.map((name) => `, ${name.toUpperCase()} ${message[name].toFixed(name === "psnr" ? 1 : 4)}`);
    at.told.textContent = `${NAMES[by]}, ${width} × ${height}, ${Math.round(total(message.ms))} ms${told.join("")}`;
    if (known && !known.size) {
      cost = performance.now() - known.at;
      if (by === "network") sharpen(message.size, message.ms);
    }
  }

  function onfigures({ id, model, objects, rows, canvas, ms, psnr, ssim, flip }) {
    if (id !== wanted.figures) return;
    const lines = {
      model, objects, "rows of the Program": rows, canvas: canvas?.join(" × "),
      PSNR: psnr == null ? null : `${psnr.toFixed(2)} dB`, SSIM: ssim?.toFixed(4), FLIP: flip?.toFixed(4),
      ...Object.fromEntries(Object.entries(ms ?? {}).map(([name, value]) => [`${name}, ms`, value.toFixed(1)])),
    };
    const known = Object.entries(lines).filter(([, value]) => value !== null && value !== undefined);
    at.figures.replaceChildren(
      ...known.flatMap(([name, value]) => [element("dt", {}, name), element("dd", {}, plainText(String(value)))]),
    );
  }

  // ---------------------------------------------------------------- the shader's

  /** Show the server's picture (`still`), the shader's once it is drawn (`live`), or none; one unseen costs nothing. */
  function show(which) {
    shows = which;
    at.canvas.hidden = which === "still" || drawn !== null;
    if (which !== "live") {
      at.still.hidden = which === "none";
      at.stage.dataset.shows = which;
    }
  }

  function showShader() {
    if (drawn || unable || !viewer) return;
    show("live");
    const draft = viewer.view.around ? ", a draft of the light" : "";
    at.told.textContent = `shader${draft}${isByHand() ? ", camera moved by hand" : ""}`;
  }

  function touched({ kind }) {
    if (kind === "drawn" && shows === "live") {
      at.still.hidden = true;
      at.stage.dataset.shows = "live";
    }
    if (!["param", "frame", "camera", "play"].includes(kind)) return;
    showShader();
    rest();
  }

  function wrong({ kind, name, message }) {
    if (kind === "param") controls?.params.refuse(name, message);
    else note(message);
  }

  function viewerOf(view) {
    try {
      const made = new Viewer(at.canvas, view, { onerror: wrong });
      steer({  // from the stage, as a hidden canvas hears nothing
        canvas: at.stage,
        orbit: (...way) => made.orbit(...way),
        pan: (...way) => made.pan(...way),
        zoom: (factor) => made.zoom(factor),
        set camera(camera) {
          made.camera = camera;
        },
      });
      return made;
    } catch (error) {
      drawn = error.message;
      note(null);
      return new Numbers(view);
    }
  }

  /** Take over a view; the shader shows it where the server has not in a while. */
  async function apply(version, message) {
    const mine = (latest = {});
    const view = await readView(JSON.parse(message));
    if (mine !== latest || unable) return;
    const mark = JSON.stringify([view.params, view.fixed, view.animation, view.dimension]);
    const isOther = controls?.mark !== mark;
    if (isOther) forget();
    if (viewer === null) {
      viewer = viewerOf(view);
      viewer.watch(touched);
    } else {
      try {
        viewer.view = view;
      } catch (error) {
        note(error.message);
        return;
      }
    }
    const waits = at.still.dataset.version && !isLive() && cost < SLOW_MS;
    if (written) viewer.camera = null;
    written = false;
    at.canvas.style.setProperty("--ratio", view.canvas[0] / view.canvas[1]);
    at.stage.tabIndex = view.dimension === 3 ? 0 : -1;
    at.stage.style.touchAction = view.dimension === 3 ? "none" : "auto";
    at.canvas.setAttribute("aria-label", plainText(view.alt ?? view.title));
    at.still.alt = plainText(view.alt ?? view.title);
    if (isOther) arrange(view, mark);
    if (asked[wanted[by]]?.params !== JSON.stringify(moved())) rest(0);  // there are other params now
    const isBehind = () => Number(at.still.dataset.version ?? -1) < version || isLive();
    later("shader", () => mine === latest && isBehind() && showShader(), waits ? Math.max(START_MS, 1.5 * cost) : 0);
  }

  /** Take the controls away. */
  function forget() {
    for (const part of controls?.parts ?? []) part.dispose();
    controls = null;
    at.controls.replaceChildren();
  }

  /** Make the controls of a view; `mark` tells those of others. */
  function arrange(view, mark) {
    const params = paramControls(viewer);
    const parts = [params];
    if (view.animation) parts.unshift(timeline(viewer));
    if (view.dimension === 3 && !drawn) {
      const camera = cameraControls(viewer);
      const write = element("button", { type: "button", class: "write" }, "Write camera");
      write.addEventListener("click", () => {
        written = true;
        oncamera(viewer.cameraLine());
      });
      const refresh = () => (write.disabled = !viewer.moved);
      const unwatch = viewer.watch(refresh);
      refresh();
      camera.box.prepend(write);
      parts.push(camera, { box: "", dispose: unwatch });
    }
    controls = { mark, parts, params };
    at.controls.replaceChildren(...parts.map(({ box }) => box));
  }

  return {
    onpicture,
    onfigures,
    /** Another file is shown. */
    open(name, most) {
      if (name === file) return;
      file = name;
      mostSide = most ?? mostSide;
      wanted = {};
      cost = 0;
      expected = false;
      written = false;
      latest = unable = null;
      delete at.still.dataset.version;
      show("none");
      if (viewer) {
        viewer.pause();
        viewer.camera = null;
        viewer.reset();
        viewer.frame = 0;
      }
      stop("rest", "sharp", "figures", "shader");
    },
    /** The text has changed, and the server has it. */
    onedit() {
      stop("sharp", "rest");
      if (by === "network" && !isLive()) ask(by);
      else rest(2 * REST_MS);
      figuresSoon();
      expected = true;
    },
    onview({ file: of, version, view, problems, again }) {
      if (of !== file) return;
      faulty = view === null && problems.some(({ severity }) => severity === "error");
      if (faulty) {  // the language server counts them, of all the text
        note(`${at.stage.dataset.shows === "none" ? "No picture" : "The last picture"}: the text has mistakes`);
        return;
      }
      unable = view === null ? (problems.at(-1)?.message ?? "no page draws it") : null;
      note(null);
      if (!again) {
        if (!expected) rest(0);
        expected = false;
      }
      if (unable) forget();
      else apply(version, view);
    },
    onerror(id, message) {
      if (Object.values(wanted).includes(id)) later("note", () => !faulty && note(message), REST_MS);
    },
    /** Choose what draws: `shader`, `network`, `reference` or `difference`. */
    choose(what) {
      by = what;
      stop("rest", "sharp");
      if (by === "shader") showShader();
      else {
        at.told.textContent = "drawing …";
        ask(by);
      }
    },
    /** Show or hide the figures. */
    toggleFigures(open) {
      figuresOpen = open;
      at.figures.hidden = !open;
      if (!open) return;
      at.figures.replaceChildren(element("dt", {}, "measuring …"));
      ask("figures");
    },
    /** What a download takes along. */
    inputs: () => ({ params: moved(), frame: viewer?.frame ?? 0 }),
    canvas: () => viewer?.view.canvas ?? [256, 256],
    isAnimated: () => Boolean(viewer?.view.animation),
  };
}
