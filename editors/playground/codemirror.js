// What the page of `scenelang play` takes of CodeMirror.
export {
  EditorView, keymap, hoverTooltip, showTooltip, lineNumbers, highlightActiveLine, highlightActiveLineGutter,
  highlightSpecialChars, drawSelection, dropCursor, rectangularSelection, crosshairCursor,
} from "@codemirror/view";
export { EditorState, StateEffect, StateField, Text } from "@codemirror/state";
export {
  StreamLanguage, HighlightStyle, syntaxHighlighting, bracketMatching, indentOnInput, indentUnit,
} from "@codemirror/language";
export { lintGutter, setDiagnostics, lintKeymap, nextDiagnostic } from "@codemirror/lint";
export {
  autocompletion, closeBrackets, closeBracketsKeymap, completionKeymap, snippet,
} from "@codemirror/autocomplete";
export { defaultKeymap, history, historyKeymap, indentWithTab, isolateHistory } from "@codemirror/commands";
export { search, searchKeymap, highlightSelectionMatches } from "@codemirror/search";
export { tags } from "@lezer/highlight";
