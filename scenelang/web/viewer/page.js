import { cameraControls, paramControls, timeline } from "./controls.js";
import { copyButton, element, isolated, listing } from "./dom.js";
import { steer } from "./steer.js";
import { inflated, readView } from "./store.js";
import { Viewer } from "./viewer.js";

/** Draw the view that a page holds, and put the controls beside it; without WebGL2 the still picture stays. */
export async function openPage() {
  const at = (id) => document.getElementById(id);
  const message = await inflated(at("view").textContent).json();
  showTexts(message, at("texts"));
  try {
    return showView(await readView(message), at);
  } catch (error) {
    at("note").textContent = `A still picture: ${firstLine(error.message)}.`;
    at("note").hidden = false;
    return null;
  }
}

function showView(view, at) {
  const note = at("note");
  const canvas = at("canvas");
  let controls = null;
  const refusals = {
    param: ({ name, message }) => controls?.refuse(name, message),
    lost: ({ message }) => say(message),
    shader: ({ message }) => say(`The picture cannot be drawn any more: ${firstLine(message)}`),
  };
  const say = (text) => {
    note.textContent = text ?? "";
    note.hidden = text === null;
  };
  const viewer = new Viewer(canvas, view, {
    onerror: (told) => refusals[told.kind](told),
  });
  const unwatch = viewer.watch(({ kind }) => {
    if (kind !== "drawn") return;
    at("still").hidden = true;
    canvas.classList.add("drawn");
    unwatch();
  });
  const box = at("controls");
  if (view.animation) box.append(timeline(viewer).box);
  if (view.params.length || view.fixed.length) {
    controls = paramControls(viewer);
    box.append(controls.box);
  }
  if (view.dimension === 3) {
    steer(viewer);
    box.append(cameraControls(viewer).box);
  }
  if (view.animation && !matchMedia("(prefers-reduced-motion: reduce)").matches) viewer.play();
  return viewer;
}

/** What a note has room for; compilers of shaders say more. */
const firstLine = (text) => text.split("\n", 1)[0].slice(0, 200);

/** Sources and licences, below the picture. */
function showTexts({ source, licences }, box) {
  for (const { name, text } of source) {
    const summary = element("summary", {}, "Source ", isolated(name));
    box.append(element("details", {}, summary, copyButton("Copy", () => text), listing(text)));
  }
  for (const { text } of licences) box.append(element("p", {}, "Shown by licence: ", isolated(text)));
}
