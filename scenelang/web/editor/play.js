// The page of `scenelang play`: it puts the parts together and knows what the buttons do.
import { assistance, format, showMistakes } from "./assist.js";
import { EditorView, nextDiagnostic } from "./codemirror.js";
import { makeDivider, makeBars, askName, askDownload } from "./chrome.js";
import { makeDocuments } from "./documents.js";
import { makeEditor } from "./editor.js";
import { languageServer, toOffset } from "./languageserver.js";
import { makePicture } from "./picture.js";
import { connect } from "./sockets.js";
import { settled } from "./statements.js";
import { element } from "./viewer/dom.js";

const at = (id) => document.getElementById(id);
const nonce = document.querySelector("script[type=module]").nonce;
const address = (path) => new URL(path, location.href).href.replace(/^http/, "ws");
const SHORT = "nsg 1;\n\nsquare { scale(0.6); material flat { color(#2a6f97); } }\n";

let known = { files: [], examples: [], most: {} };
let download = null;  // {id, done} of the one that is being made
let renaming = null;  // [file, to]
let goal = null;  // {file, position} to go to once it is shown

const bars = makeBars(at("bars"));
const server = languageServer(address("lsp"), {
  ondiagnostics(uri, version, found) {
    const document = documents.at(uri);
    if (!document || version !== server.version(uri)) return;
    document.found = { version, found };
    if (document === documents.current()) showFound();
  },
  onstate: (up) => (at("problems").disabled = !up),
});

const editor = makeEditor(at("editor"), {
  nonce,
  onchange: (update) => documents.onchange(update),
  onsave: save,
  extensions: assistance(server, () => documents.current(), go, EditorView.updateListener),
});

const picture = makePicture(
  { stage: at("stage"), canvas: at("canvas"), still: at("still"), note: at("note"), told: at("told"),
    controls: at("controls"), figures: at("figures") },
  {
    send: (message) => live.send(message),
    oncamera: (line) => editor.change(settled(editor.view.state.doc.toString(), "camera", line)),
  },
);

const documents = makeDocuments({
  editor,
  server,
  bars,
  send: (message) => live.send(message),
  onshow({ file }) {
    picture.open(file, known.most.side);
    showFiles();
    showFound();
    editor.view.focus();
    reach();
  },
  onsent: () => picture.onedit(),
  onstate: showState,
});

const live = connect(address("live"), {
  onopen() {
    at("line").textContent = "";
    documents.again();
  },
  onclose: () => (at("line").textContent = "The server does not answer; what is typed is kept in this browser"),
  onmessage(message) {
    answers[message.kind]?.(message);
  },
});

const answers = {
  files(message) {
    known = message;
    documents.setFolder(message.uri);
    if (renaming && message.files.includes(renaming[1])) {
      documents.renamed(...renaming);
      renaming = null;
    } else if (!documents.current()) {
      const first = message.open ?? message.files[0];
      if (first) documents.open(first);
      else makeNew();
    }
    showFiles();
  },
  text: (message) => documents.ontext(message),
  saved: (message) => documents.onsaved(message),
  conflict: (message) => documents.onconflict(message),
  view: (message) => picture.onview(message),
  picture: (message) => picture.onpicture(message),
  figures: (message) => picture.onfigures(message),
  progress({ id, done }) {
    if (id === download) bars.ask("download", `Making it: ${Math.round(100 * done)} %`, { Cancel: cancelDownload });
  },
  ready({ id, url, name }) {
    if (id !== download) return;
    bars.close("download");
    download = null;
    element("a", { href: url, download: name }).click();
  },
  error({ id, message }) {
    if (id === null) renaming = null;
    if (id === null || id === download) bars.ask("error", message, { OK() {} });
    else picture.onerror(id, message);
    if (id === download) {
      bars.close("download");
      download = null;
    }
  },
};

/** Show what the language server has found in the text, if that is what it has. */
function showFound() {
  const shown = documents.current();
  const { version, found } = shown.found ?? {};
  const isOf = version !== undefined && version === server.version(shown.uri);
  const errors = isOf ? found.filter(({ severity }) => severity === 1).length : 0;
  at("problems").classList.toggle("wrong", errors > 0);
  at("problems").textContent = "…";
  if (!isOf) return;
  showMistakes(server, shown, editor.view, found);
  const told = [[errors, "mistake"], [found.length - errors, "warning"]].filter(([count]) => count);
  at("problems").textContent = told.map(([n, what]) => `${n} ${what}${n > 1 ? "s" : ""}`).join(", ") || "No mistakes";
}

// ---------------------------------------------------------------- files

function showFiles() {
  const shown = documents.current()?.file;
  const names = [...new Set([...known.files, ...(shown ? [shown] : [])])];
  const label = (name) => `${documents.isUnsaved(name) ? "• " : ""}${name}`;
  at("files").replaceChildren(...names.map((name) => element("option", { value: name }, label(name))));
  at("files").value = shown ?? "";
}

function showState() {
  const shown = documents.current();
  const unsaved = shown !== null && documents.isUnsaved(shown.file);
  if (at("unsaved").hidden === unsaved) showFiles();
  at("unsaved").hidden = !unsaved;
  document.title = shown ? `${unsaved ? "• " : ""}${shown.file} – scenelang` : "scenelang play";
}

async function save() {
  const shown = documents.current();
  if (!shown) return;
  await format(server, shown, editor.view);
  if (documents.current() === shown && !documents.save()) {
    bars.ask("error", "Not saved: the server does not answer", { OK() {} });
  }
}

async function makeNew() {
  const asked = await askName(at("naming"), "New scene", "", known.examples);
  if (!asked) return;
  let text = SHORT;
  if (asked.example) {
    const answer = await fetch(`static/examples/${encodeURIComponent(asked.example)}`);
    if (answer.ok) text = await answer.text();
  }
  documents.make(asked.file, text);
}

async function rename() {
  const shown = documents.current();
  const asked = shown && (await askName(at("naming"), `Rename ${shown.file}`, shown.file, null));
  if (!asked || asked.file === shown.file) return;
  if (documents.isUnsaved(shown.file)) {
    bars.ask("error", `Save ${shown.file} before it is renamed`, { OK() {} });
    return;
  }
  renaming = [shown.file, asked.file];
  live.send({ kind: "rename", file: shown.file, to: asked.file });
}

/** Show a place of a file of the folder, which may have to be opened. */
function go(uri, position) {
  if (!uri.startsWith(documents.folder())) return;
  goal = { file: decodeURIComponent(uri.slice(documents.folder().length)), position };
  if (documents.current().file === goal.file) reach();
  else documents.open(goal.file);
}

function reach() {
  if (documents.current().file !== goal?.file) return;
  editor.go(toOffset(editor.view.state.doc, goal.position));
  goal = null;
}

// ---------------------------------------------------------------- downloads

async function makeDownload() {
  const shown = documents.current();
  const [width, height] = picture.canvas();
  const asked = shown && (await askDownload(at("saving"), width, picture.isAnimated()));
  if (!asked) return;
  cancelDownload();
  download = `download-${performance.now()}`;
  const size = [asked.width, Math.max(1, Math.round((asked.width * height) / width))];
  bars.ask("download", "Making it …", { Cancel: cancelDownload });
  live.send({ kind: "download", id: download, file: shown.file, as: asked.as, size, ...picture.inputs() });
}

function cancelDownload() {
  if (download) live.send({ kind: "cancel", id: download });
  download = null;
  bars.close("download");
}

// ---------------------------------------------------------------- the page

makeDivider(at("divider"), document.querySelector("main"));
at("files").addEventListener("change", () => documents.open(at("files").value));
at("save").addEventListener("click", save);
at("new").addEventListener("click", makeNew);
at("rename").addEventListener("click", rename);
at("download").addEventListener("click", makeDownload);
at("problems").addEventListener("click", () => {
  nextDiagnostic(editor.view);
  editor.view.focus();
});
at("by").addEventListener("change", ({ target }) => picture.choose(target.value));
at("measure").addEventListener("change", ({ target }) => picture.toggleFigures(target.checked));
addEventListener("keydown", (event) => {
  if (!(event.ctrlKey || event.metaKey) || event.key !== "s" || event.defaultPrevented) return;
  event.preventDefault();
  save();
});
addEventListener("pagehide", () => documents.keepAll());
