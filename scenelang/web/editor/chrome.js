// Parts of the page around text and picture: questions, dialogs, the divider.
import { element, plainText } from "./viewer/dom.js";

/** Lines above the text that tell or ask something, one of a key at a time. */
export function makeBars(box) {
  const shown = new Map();
  const close = (key) => {
    shown.get(key)?.remove();
    shown.delete(key);
  };
  return {
    close,
    /** Show a text and a button for each choice, which closes it. */
    ask(key, text, choices) {
      const buttons = Object.entries(choices).map(([label, act]) => {
        const onclick = () => {
          close(key);
          act();
        };
        return element("button", { type: "button", onclick }, label);
      });
      const made = element("div", { class: "bar asks" }, element("span", {}, plainText(text)), ...buttons);
      if (shown.has(key)) shown.get(key).replaceWith(made);
      else box.append(made);
      shown.set(key, made);
    },
  };
}

/** What a dialog's form was answered with; null where it was left. */
function answered(dialog) {
  return new Promise((done) => {
    dialog.returnValue = "";
    dialog.addEventListener("close", () => done(dialog.returnValue || null), { once: true });
    dialog.showModal();
  });
}

/** Ask for the name of a file, and for an example to begin with where there are some. */
export async function askName(dialog, title, name, examples) {
  const { file, example } = dialog.querySelector("form").elements;
  dialog.querySelector("h2").textContent = title;
  dialog.querySelector("#begin").hidden = examples === null;
  const options = ["", ...(examples ?? [])].map((each) => element("option", { value: each }, each || "a square"));
  example.replaceChildren(...options);
  example.onchange = () => (file.value ||= example.value);
  file.value = name;
  if (!(await answered(dialog))) return null;
  const typed = file.value.trim();
  return { file: typed.endsWith(".nsg") ? typed : `${typed}.nsg`, example: example.value };
}

/** Ask for the kind of a download and the width of its pictures. */
export async function askDownload(dialog, canvasWidth, isAnimated) {
  const { width } = dialog.querySelector("form").elements;
  width.value = canvasWidth;
  dialog.querySelector("[value=gif]").disabled = !isAnimated;
  const as = await answered(dialog);
  return as && { as, width: width.valueAsNumber || canvasWidth };
}

/** Let pointer and arrow keys set how wide the text is; it is remembered. */
export function makeDivider(divider, main) {
  const set = (share) => {
    const kept = Math.max(0.2, Math.min(0.8, share));
    main.style.setProperty("--share", `${(100 * kept).toFixed(2)}%`);
    divider.setAttribute("aria-valuenow", Math.round(100 * kept));
    try {
      localStorage.setItem("scenelang share", kept);
    } catch {  // it is forbidden: the page begins in the middle again
    }
    return kept;
  };
  let share = 0.5;
  try {
    share = Number(localStorage.getItem("scenelang share")) || 0.5;
  } catch {
    share = 0.5;
  }
  share = set(share);
  divider.addEventListener("pointerdown", (event) => {
    event.preventDefault();
    divider.setPointerCapture(event.pointerId);
  });
  divider.addEventListener("pointermove", (event) => {
    if (!divider.hasPointerCapture(event.pointerId)) return;
    const { left, width } = main.getBoundingClientRect();
    share = set((event.clientX - left) / width);
  });
  divider.addEventListener("keydown", ({ key }) => {
    const way = { ArrowLeft: -0.02, ArrowRight: 0.02 }[key];
    if (way) share = set(share + way);
  });
}
