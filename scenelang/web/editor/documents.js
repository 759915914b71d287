// The open files: their texts here, in the editor, with the server and on the disk, kept in step.
import { Text } from "./codemirror.js";

const SEND_MS = 15;  // edits that come faster go together
const KEEP_MS = 400;  // how long after an edit its text is kept in this browser too

const textOf = (string) => Text.of(string.split("\n"));

function ago(seconds) {
  const minutes = Math.round(seconds / 60);
  if (minutes < 1) return "just now";
  return minutes < 60 ? `${minutes} min ago` : `${Math.round(minutes / 60)} h ago`;
}

/**
 * @param {{editor: object, server: object, send: (message: object) => boolean, bars: object,
 *   onshow: (document: object) => void, onsent: () => void, onstate: () => void}} parts `bars` shows and hides
 *   questions: `ask(key, text, choices)`, `close(key)`
 */
export function makeDocuments({ editor, server, send, bars, onshow, onsent, onstate }) {
  const documents = new Map();  // file -> {file, uri, state, version, disk, saved: Text | null}
  let current = null;
  let folder = "";  // its address
  let wish = null;  // the file to show once it is here
  let fresh = null;  // {file, text} of one to make

  const stateOf = (document) => (document === current ? editor.view.state : document.state);
  const isUnsaved = (document) => document.saved === null || !stateOf(document).doc.eq(document.saved);
  const key = (document) => `scenelang ${document.uri}`;

  // ---------------------------------------------------------------- to the server and to the store of this browser

  /** Tell the server a text: at once, unless it was told one a moment ago. */
  function sendSoon(document) {
    if (document.timer) return;
    const wait = SEND_MS - (performance.now() - (document.sentAt ?? -SEND_MS));
    if (wait <= 0) sendNow(document);
    else document.timer = setTimeout(() => sendNow(document), wait);
  }

  function sendNow(document) {
    clearTimeout(document.timer);
    document.timer = null;
    document.sentAt = performance.now();
    const text = stateOf(document).doc.toString();
    send({ kind: "edit", file: document.file, version: document.version, text });
    if (document === current) onsent();
  }

  function keepSoon(document) {
    clearTimeout(document.keeping);
    document.keeping = setTimeout(() => keep(document), KEEP_MS);
  }

  function keep(document) {
    clearTimeout(document.keeping);
    try {
      if (!isUnsaved(document)) localStorage.removeItem(key(document));
      else {
        const text = stateOf(document).doc.toString();
        localStorage.setItem(key(document), JSON.stringify({ text, disk: document.disk, at: Date.now() }));
      }
    } catch {  // it is full or forbidden: the server keeps the text too
    }
  }

  function kept(document) {
    try {
      const { text, disk, at } = JSON.parse(localStorage.getItem(key(document)));
      return { text, disk, seconds: (Date.now() - at) / 1000 };
    } catch {
      return null;
    }
  }

  // ---------------------------------------------------------------- showing and changing

  function show(document) {
    if (current && current !== document) current.state = editor.view.state;
    current = document;
    editor.show(document.state);
    onshow(document);
    onstate();
  }

  /** Make a document's text another one, shown or not. */
  function replace(document, text) {
    if (document === current) editor.replace(text);
    else {
      document.state = editor.state(text);
      document.version += 1;
      server.open(document.uri, document.state.doc);
      sendNow(document);
    }
    onstate();
  }

  function first({ file, text, version, disk, unsaved }) {
    const state = editor.state(text ?? "");
    const document = { file, uri: folder + file.split("/").map(encodeURIComponent).join("/"), state, version, disk };
    document.saved = disk === null ? null : state.doc;
    documents.set(file, document);
    server.open(document.uri, state.doc);
    if (wish === file || current === null) show(document);
    if (fresh?.file === file) {
      if (text === null) {
        replace(document, fresh.text);
        save();
      } else bars.ask(`back ${file}`, `There is a file ${file} already`, { OK() {} });
      fresh = null;
      return;
    }
    const lost = unsaved ?? kept(document);
    if (!lost || lost.text === (text ?? "")) return;
    replace(document, lost.text);
    const also = lost.disk === disk ? "" : "; the file has changed on the disk since";
    bars.ask(`back ${file}`, `Text of ${file} that was not saved (${ago(lost.seconds)}) is back${also}`, {
      "Keep it": () => {},
      "Take the file": () => {
        replace(document, text ?? "");
        send({ kind: "discard", file });
        keep(document);
      },
    });
  }

  /** Have the shown text written; whether that could be sent. */
  function save() {
    const document = current;
    const text = editor.view.state.doc;
    document.saving = { version: document.version, text };
    const { file, version, disk } = document;
    return send({ kind: "save", file, version, text: text.toString(), base: disk });
  }

  /** The file holds something else than what is edited here. */
  function differs(document, text, disk) {
    const { file } = document;
    bars.ask(`differs ${file}`, `${file} has changed on the disk, and here`, {
      "Take that of the disk": () => {
        Object.assign(document, { disk, saved: textOf(text) });
        replace(document, text);
        keep(document);
      },
      "Keep mine": () => {
        Object.assign(document, { disk, saved: textOf(text) });
        onstate();
      },
    });
  }

  function onDisk(document, text, disk) {
    if (disk === document.disk) return;
    if (text === null) {
      Object.assign(document, { disk, saved: null });
      bars.ask(`differs ${document.file}`, `${document.file} is gone from the disk; saving writes it again`, { OK() {} });
      onstate();
      return;
    }
    const same = stateOf(document).doc.eq(textOf(text));
    if (same || !isUnsaved(document)) {
      Object.assign(document, { disk, saved: textOf(text) });
      bars.close(`differs ${document.file}`);
      if (!same) replace(document, text);
      onstate();
    } else differs(document, text, disk);
  }

  return {
    current: () => current,
    isUnsaved: (file) => documents.has(file) && isUnsaved(documents.get(file)),
    at: (uri) => [...documents.values()].find((document) => document.uri === uri),
    /** The page goes away: keep what is not saved, in this browser. */
    keepAll: () => documents.forEach(keep),
    has: (file) => documents.has(file),
    folder: () => folder,
    setFolder: (uri) => (folder = uri),
    /** Show a file, which the server is asked for. */
    open(file) {
      wish = file;
      if (documents.has(file)) show(documents.get(file));
      send({ kind: "open", file });
    },
    /** Make a file of this text and show it; one that is there is shown as it is. */
    make(file, text) {
      if (!documents.has(file)) fresh = { file, text };
      this.open(file);
    },
    /** The connection is back: say again what is open. */
    again() {
      for (const file of documents.keys()) send({ kind: "open", file });
    },
    /** The editor's text has changed. */
    onchange(update) {
      current.version += 1;
      sendSoon(current);
      server.change(current.uri, update.startState.doc, update.changes, update.state.doc);
      keepSoon(current);
      onstate();
    },
    ontext(message) {
      const document = documents.get(message.file);
      if (!document) {
        if (message.origin === "open") first(message);
        return;
      }
      onDisk(document, message.text, message.disk);
      if (message.origin !== "open") return;
      document.version = Math.max(document.version, message.version) + 1;
      sendNow(document);
    },
    save,
    onsaved({ file, version, disk }) {
      const document = documents.get(file);
      if (!document) return;
      document.disk = disk;
      if (document.saving?.version === version) document.saved = document.saving.text;
      for (const question of ["differs", "back"]) bars.close(`${question} ${file}`);
      server.saved(document.uri);
      keep(document);
      onstate();
    },
    onconflict({ file, text, disk }) {
      const document = documents.get(file);
      if (!document) return;
      if (text === null) onDisk(document, text, disk);
      else differs(document, text, disk);
    },
    /** A file is called otherwise now. */
    renamed(file, to) {
      const document = documents.get(file);
      if (!document) return;
      documents.delete(file);
      server.close(document.uri);
      current = document === current ? null : current;
      this.open(to);
    },
  };
}
