// The editor: one view, a state for each text.
import {
  bracketMatching, closeBrackets, closeBracketsKeymap, completionKeymap, crosshairCursor, defaultKeymap,
  drawSelection, dropCursor, EditorState, EditorView, highlightActiveLine, highlightActiveLineGutter,
  highlightSelectionMatches, highlightSpecialChars, history, historyKeymap, indentOnInput, indentUnit, isolateHistory,
  indentWithTab, keymap, lineNumbers, lintGutter, lintKeymap, rectangularSelection, searchKeymap, search,
} from "./codemirror.js";
import { scenelang } from "./language.js";
import { difference } from "./statements.js";

const BIDI = /[\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069]/g;

const theme = EditorView.theme({
  "&": { height: "100%", color: "var(--ink)", backgroundColor: "var(--paper)", fontSize: "13.5px" },
  "&.cm-focused": { outline: "none" },
  ".cm-scroller": { fontFamily: "var(--mono)", lineHeight: "1.5" },
  ".cm-content": { caretColor: "var(--ink)" },
  ".cm-cursor": { borderLeftColor: "var(--ink)" },
  ".cm-gutters": { backgroundColor: "var(--paper)", color: "var(--dim)", border: "none" },
  ".cm-activeLine, .cm-activeLineGutter": { backgroundColor: "var(--active)" },
  "&.cm-focused > .cm-scroller > .cm-selectionLayer .cm-selectionBackground, .cm-selectionBackground": {
    backgroundColor: "var(--selection) !important",
  },
  ".cm-selectionMatch": { backgroundColor: "var(--match)" },
  "&.cm-focused .cm-matchingBracket": { backgroundColor: "var(--match)", outline: "1px solid var(--dim)" },
  ".cm-tooltip, .cm-panels": { backgroundColor: "var(--panel)", color: "var(--ink)", border: "1px solid var(--line)" },
  ".cm-tooltip": { borderRadius: "6px", maxWidth: "min(34rem, 90vw)", overflow: "auto" },
  ".cm-tooltip-autocomplete > ul > li[aria-selected]": { backgroundColor: "var(--accent)", color: "var(--paper)" },
  ".cm-completionInfo": { padding: "4px 10px" },
  ".cm-panels input, .cm-panels button": { color: "inherit" },
  ".cm-button": { backgroundImage: "none", backgroundColor: "var(--active)", border: "1px solid var(--line)" },
  ".cm-textfield": { backgroundColor: "var(--paper)", border: "1px solid var(--line)" },
  ".cm-diagnosticAction": { backgroundColor: "var(--accent)", color: "var(--paper)", cursor: "pointer" },
  ".unused": { opacity: "0.6" },
});

/**
 * @param {Element} parent
 * @param {{nonce: string, onchange: (update: object) => void, onsave: () => void, extensions: object[]}} given
 */
export function makeEditor(parent, { nonce, onchange, onsave, extensions }) {
  const setup = [
    EditorView.cspNonce.of(nonce),
    // before all that asks about a text: the server has to have it
    EditorView.updateListener.of((update) => update.docChanged && onchange(update)),
    lineNumbers(), highlightActiveLineGutter(), highlightSpecialChars({ addSpecialChars: BIDI }), history(),
    drawSelection(), dropCursor(), EditorState.allowMultipleSelections.of(true), indentOnInput(), indentUnit.of("  "),
    bracketMatching(), closeBrackets(), rectangularSelection(), crosshairCursor(), highlightActiveLine(),
    highlightSelectionMatches(), lintGutter(), search({ top: true }), EditorView.lineWrapping, scenelang, theme, extensions,
    EditorView.contentAttributes.of({ "aria-label": "scene", spellcheck: "false" }),
    keymap.of([
      { key: "Mod-s", preventDefault: true, run: () => (onsave(), true) },
      ...closeBracketsKeymap, ...defaultKeymap, ...searchKeymap, ...historyKeymap, ...completionKeymap, ...lintKeymap,
      indentWithTab,
    ]),
  ];
  const state = (text) => EditorState.create({ doc: text, extensions: setup });
  const view = new EditorView({ parent, state: state("") });
  return {
    view,
    /** A state for a text. */
    state,
    /** Show a state, with its cursor in sight. */
    show(next) {
      view.setState(next);
      view.dispatch({ effects: EditorView.scrollIntoView(next.selection.main.head) });
    },
    /** Change the shown text in one step of undo, and show where, unless it is not to move. */
    change(changes, moves = true) {
      const effects = moves ? EditorView.scrollIntoView(changes.from) : [];
      view.dispatch({ changes, effects, annotations: isolateHistory.of("full"), userEvent: "input.made" });
    },
    /** Make the shown text another one, with cursors where they are as far as that goes. */
    replace(text) {
      const before = view.state.doc.toString();
      if (before !== text) this.change(difference(before, text), false);
    },
    /** Put the cursor somewhere, in sight. */
    go(offset) {
      view.dispatch({ selection: { anchor: offset }, effects: EditorView.scrollIntoView(offset, { y: "center" }) });
      view.focus();
    },
  };
}
