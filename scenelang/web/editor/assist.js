// What the language server knows, in the editor: completion, hover, arguments, mistakes and their fixes, definitions.
import {
  autocompletion, hoverTooltip, keymap, setDiagnostics, showTooltip, snippet, StateEffect, StateField,
} from "./codemirror.js";
import { toOffset, toPosition } from "./languageserver.js";
import { markdown } from "./markdown.js";
import { element } from "./viewer/dom.js";

const FORMAT_MS = 2000;  // how long a save waits for the layout
const KINDS = {  // of the protocol -> CodeMirror's pictures
  2: "function", 3: "function", 6: "variable", 7: "class", 9: "namespace", 10: "property", 11: "constant",
  12: "constant", 14: "keyword", 15: "text", 17: "text", 20: "enum", 21: "constant",
};

/** The change of a CodeMirror text that edits of the protocol make. */
export function toChanges(text, edits) {
  return edits.map(({ range, newText }) => ({
    from: toOffset(text, range.start), to: toOffset(text, range.end), insert: newText,
  }));
}

function proposal(item) {
  const filled = item.insertTextFormat === 2;
  const insert = item.textEdit?.newText ?? item.insertText ?? item.label;
  return {
    label: item.label,
    type: KINDS[item.kind],
    detail: item.detail,
    sortText: item.sortText,
    apply: filled ? snippet(insert.replace(/\$(\d)/g, "${$1}")) : insert,
    info: item.documentation ? () => markdown(item.documentation.value) : undefined,
  };
}

function completion(server, current) {
  return async (context) => {
    const { state, pos } = context;
    const typed = context.matchBefore(/[.(,="/]|\w+/);
    if (!typed && !context.explicit) return null;
    const place = { position: toPosition(state.doc, pos) };
    const found = await server.ask("completion", current().uri, place);
    const items = found?.items ?? found ?? [];
    if (!items.length || context.aborted) return null;
    const range = items[0].textEdit?.range;
    return {
      from: range ? toOffset(state.doc, range.start) : (context.matchBefore(/\w+/)?.from ?? pos),
      to: range ? toOffset(state.doc, range.end) : pos,
      options: items.map(proposal),
      validFor: found.isIncomplete ? undefined : /^\w*$/,
    };
  };
}

function hover(server, current) {
  return hoverTooltip(async (view, at) => {
    const text = view.state.doc;
    const found = await server.ask("hover", current().uri, { position: toPosition(text, at) });
    const shown = found?.contents?.value;
    if (!shown || view.state.doc !== text) return null;
    const [pos, end] = found.range ? [found.range.start, found.range.end].map((p) => toOffset(text, p)) : [at, at];
    return { pos, end, above: true, create: () => ({ dom: markdown(shown) }) };
  });
}

const argued = StateEffect.define();  // a tooltip of arguments, or null

const argumentsField = StateField.define({
  create: () => null,
  update(tip, transaction) {
    for (const effect of transaction.effects) if (effect.is(argued)) return effect.value;
    return tip && transaction.docChanged ? { ...tip, pos: transaction.changes.mapPos(tip.pos) } : tip;
  },
  provide: (field) => showTooltip.from(field),
});

function callShown({ label, parameters, activeParameter }) {
  const at = parameters?.[activeParameter]?.label;
  const start = Array.isArray(at) ? at[0] : at ? label.indexOf(at) : -1;
  if (start < 0) return element("div", { class: "call" }, label);
  const end = Array.isArray(at) ? at[1] : start + at.length;
  const active = element("strong", {}, label.slice(start, end));
  return element("div", { class: "call" }, label.slice(0, start), active, label.slice(end));
}

/** Shows what the call at the cursor takes, from the typing of `(` or `,` until the cursor leaves it. */
async function argumentsAt(server, current, view) {
  const { state } = view;
  const pos = state.selection.main.head;
  const found = await server.ask("signatureHelp", current().uri, { position: toPosition(state.doc, pos) });
  if (view.state.doc !== state.doc || view.state.selection.main.head !== pos) return;
  const one = found?.signatures?.[found.activeSignature ?? 0];
  const shown = one && { ...one, activeParameter: one.activeParameter ?? found.activeParameter };
  const tip = shown ? { pos, above: true, create: () => ({ dom: callShown(shown) }) } : null;
  view.dispatch({ effects: argued.of(tip) });
}

function argumentsHelp(server, current, watch) {
  const follow = watch.of((update) => {
    if (!update.docChanged && !update.selectionSet) return;
    let opens = update.state.field(argumentsField) !== null;
    if (update.transactions.some((transaction) => transaction.isUserEvent("input.type"))) {
      const head = update.state.selection.main.head;
      opens ||= /[(,]\s?\)?$/.test(update.state.sliceDoc(Math.max(0, head - 2), head));
    }
    if (opens) argumentsAt(server, current, update.view);
  });
  const close = (view) => {
    if (!view.state.field(argumentsField)) return false;
    view.dispatch({ effects: argued.of(null) });
    return true;
  };
  return [argumentsField, follow, keymap.of([{ key: "Escape", run: close }])];
}

function mistakeShown({ message, code, severity }) {
  const [fact, ...help] = message.split("\n");
  return element(
    "div", { class: "mistake" },
    element("span", { class: "code" }, `${severity === 1 ? "error" : "warning"} ${code ?? ""}`), ` ${fact}`,
    ...help.map((line) => element("div", { class: "help" }, line)),
  );
}

/** What the server found, shown in a view that has this very text; fixes are asked for and come along. */
export async function showMistakes(server, document, view, found) {
  const text = view.state.doc;
  const made = (fixes) => found.map((item) => {
    const from = toOffset(text, item.range.start);
    const same = (other) => other.code === item.code && JSON.stringify(other.range) === JSON.stringify(item.range);
    const actions = fixes.filter((fix) => fix.diagnostics?.some(same)).map((fix) => ({
      name: fix.title,
      apply: (target) => {
        const edits = fix.edit.changes[document.uri] ?? [];
        if (target.state.doc === text) target.dispatch({ changes: toChanges(text, edits), userEvent: "input.fix" });
      },
    }));
    return {
      from,
      to: Math.max(from, toOffset(text, item.range.end)),
      severity: item.severity === 1 ? "error" : "warning",
      message: item.message,
      renderMessage: () => mistakeShown(item),
      markClass: item.tags?.includes(1) ? "unused" : undefined,
      actions,
    };
  });
  view.dispatch(setDiagnostics(view.state, made([])));
  if (!found.length) return;
  const range = { start: { line: 0, character: 0 }, end: toPosition(text, text.length) };
  const context = { diagnostics: found, only: ["quickfix"] };
  const fixes = await server.ask("codeAction", document.uri, { range, context });
  if (fixes?.length && view.state.doc === text) view.dispatch(setDiagnostics(view.state, made(fixes)));
}

/** Lays a text out as `scenelang fmt` does, where it has no mistake that forbids it and the answer is not late. */
export async function format(server, document, view) {
  const before = view.state.doc;
  const options = { tabSize: 2, insertSpaces: true };
  const late = new Promise((done) => setTimeout(done, FORMAT_MS));
  const edits = await Promise.race([server.ask("formatting", document.uri, { options }), late]);
  if (!edits?.length || view.state.doc !== before) return;
  view.dispatch({ changes: toChanges(before, edits), userEvent: "format" });
}

function definition(server, current, go) {
  const run = (view, at) => {
    const place = { position: toPosition(view.state.doc, at) };
    server.ask("definition", current().uri, place).then((found) => {
      const target = Array.isArray(found) ? found[0] : found;
      if (target) go(target.uri ?? target.targetUri, (target.range ?? target.targetSelectionRange).start);
    });
    return true;
  };
  return keymap.of([{ key: "F12", run: (view) => run(view, view.state.selection.main.head) }]);
}

/**
 * All of it as an extension.
 * @param server as `languageServer` makes it
 * @param {() => {uri: string}} current the document that is shown
 * @param {(uri: string, position: object) => void} go show a place
 * @param watch CodeMirror's `EditorView.updateListener`
 */
export function assistance(server, current, go, watch) {
  return [
    autocompletion({ override: [completion(server, current)], activateOnTypingDelay: 50 }),
    hover(server, current),
    argumentsHelp(server, current, watch),
    definition(server, current, go),
  ];
}
