// What the page of `scenelang play` takes of CodeMirror.
export {
  EditorView, keymap, hoverTooltip, showTooltip, closeHoverTooltips, lineNumbers, highlightActiveLine,
  highlightActiveLineGutter, highlightSpecialChars, drawSelection, dropCursor, rectangularSelection, crosshairCursor,
} from "@codemirror/view";
export { EditorState, EditorSelection, StateEffect, StateField, Annotation, Transaction, Compartment, Text, Prec }
  from "@codemirror/state";
export {
  StreamLanguage, HighlightStyle, syntaxHighlighting, bracketMatching, indentOnInput, indentUnit, indentService,
  foldGutter, foldKeymap, foldService,
} from "@codemirror/language";
export { lintGutter, setDiagnostics, lintKeymap, forEachDiagnostic } from "@codemirror/lint";
export {
  autocompletion, closeBrackets, closeBracketsKeymap, completionKeymap, snippet, startCompletion, acceptCompletion,
} from "@codemirror/autocomplete";
export { defaultKeymap, history, historyKeymap, indentWithTab, isolateHistory, undo, redo } from "@codemirror/commands";
export { search, searchKeymap, highlightSelectionMatches } from "@codemirror/search";
export { tags } from "@lezer/highlight";
