// The client of the language server: which texts it has, and what it is asked about them.
import { connect, rpc } from "./sockets.js";

const CAPABILITIES = {
  general: { positionEncodings: ["utf-16"], markdown: { parser: "scenelang", allowedTags: ["img"] } },
  textDocument: {
    completion: { completionItem: { snippetSupport: true, documentationFormat: ["markdown"] } },
    hover: { contentFormat: ["markdown"] },
    publishDiagnostics: { relatedInformation: true, versionSupport: true },
    codeAction: { codeActionLiteralSupport: { codeActionKind: { valueSet: ["quickfix"] } } },
  },
};
const PAUSE_MS = 100;

/** Where an offset of a CodeMirror text stands, as the protocol counts: lines and UTF-16 units from 0. */
export function toPosition(text, offset) {
  const line = text.lineAt(offset);
  return { line: line.number - 1, character: offset - line.from };
}

/** The offset of a position, in the text where it is past the end of its line or of the text. */
export function toOffset(text, { line, character }) {
  if (line >= text.lines) return text.length;
  const { from, to } = text.line(line + 1);
  return Math.min(from + character, to);
}

/**
 * @param {string} address of the websocket
 * @param {{ondiagnostics: (uri: string, version: number, found: object[]) => void, onstate: (up: boolean) => void}} on
 */
export function languageServer(address, { ondiagnostics, onstate }) {
  const texts = new Map();  // uri -> {version, text}
  let ready = false;
  const socket = connect(address, {
    onopen: start,
    onclose() {
      ready = false;
      peer.lost();
      onstate(false);
    },
    onmessage: (message) => peer.receive(message),
  });
  const peer = rpc((message) => socket.send(message), {
    "textDocument/publishDiagnostics": ({ uri, version, diagnostics }) => ondiagnostics(uri, version, diagnostics),
  });

  async function start() {
    try {
      await peer.request("initialize", {
        processId: null,
        rootUri: null,
        capabilities: CAPABILITIES,
        initializationOptions: { debounceMs: PAUSE_MS },
      });
    } catch {
      return;  // it went away again
    }
    peer.notify("initialized", {});
    ready = true;
    onstate(true);
    for (const [uri, { version, text }] of texts) announce(uri, version, text);
  }

  function announce(uri, version, text) {
    const textDocument = { uri, languageId: "nsg", version, text: text.toString() };
    peer.notify("textDocument/didOpen", { textDocument });
  }

  return {
    /** Open a text (a CodeMirror `Text`), or say that it is another one as a whole. */
    open(uri, text) {
      const known = texts.get(uri);
      const version = (known?.version ?? 0) + 1;
      texts.set(uri, { version, text });
      if (!ready) return;
      if (!known) announce(uri, version, text);
      else {
        const change = { textDocument: { uri, version }, contentChanges: [{ text: text.toString() }] };
        peer.notify("textDocument/didChange", change);
      }
    },
    /** Tell a change (CodeMirror's `ChangeSet`) of a text, the last place first, so that no place moves another. */
    change(uri, before, changes, after) {
      const version = texts.get(uri).version + 1;
      texts.set(uri, { version, text: after });
      const contentChanges = [];
      changes.iterChanges((from, to, newFrom, newTo, inserted) => {
        const range = { start: toPosition(before, from), end: toPosition(before, to) };
        contentChanges.unshift({ range, text: inserted.toString() });
      });
      if (ready) peer.notify("textDocument/didChange", { textDocument: { uri, version }, contentChanges });
    },
    close(uri) {
      if (texts.delete(uri) && ready) peer.notify("textDocument/didClose", { textDocument: { uri } });
    },
    saved: (uri) => ready && peer.notify("textDocument/didSave", { textDocument: { uri } }),
    version: (uri) => texts.get(uri)?.version,
    /** What the server answers about a text or a place in it; null where it cannot. */
    async ask(method, uri, rest = {}) {
      if (!ready) return null;
      try {
        return await peer.request(`textDocument/${method}`, { textDocument: { uri }, ...rest });
      } catch {
        return null;
      }
    },
  };
}
