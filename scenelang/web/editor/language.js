// How scenes look and indent in the editor: colours by the words of the language, indents by brackets.
import { HighlightStyle, StreamLanguage, syntaxHighlighting, tags } from "./codemirror.js";
import { SIGNS, TERMINALS, WORDS } from "./words.js";

const escaped = (text) => text.replace(/[.*+?^${}()|[\]\\]/g, "\\$&");
const TERMINAL = Object.fromEntries(Object.entries(TERMINALS).map(([name, text]) => [name, new RegExp(text, "y")]));
const SIGN = new RegExp(SIGNS.map(escaped).join("|"), "y");
const KNOWN = new Map();  // word -> [{tag, after}]
for (const { scope, words, after } of WORDS) {
  for (const word of words) {
    const entry = { tag: scope.replaceAll(".", "_"), after: new RegExp(after, "y") };
    KNOWN.set(word, [...(KNOWN.get(word) ?? []), entry]);
  }
}
const TAGS = {  // the scopes of TextMate, whose dots mean something else here
  keyword_declaration: tags.definitionKeyword,
  keyword_control: tags.controlKeyword,
  storage_type_node: tags.keyword,
  storage_type_material: tags.modifier,
  constant_language_boolean: tags.bool,
  constant_language: tags.atom,
  variable_language: tags.special(tags.variableName),
  support_function_setting: tags.macroName,
  support_function_transform: tags.standard(tags.propertyName),
  support_function: tags.standard(tags.variableName),
  functionDefined: tags.definition(tags.variableName),
  valueDefined: tags.definition(tags.propertyName),
};
const DEFINED = { fn: "functionDefined", module: "functionDefined", let: "valueDefined", param: "valueDefined" };

/** The text that a terminal has at the stream's place, taken off it; null where it has none. */
function take(stream, pattern) {
  pattern.lastIndex = stream.pos;
  const found = pattern.exec(stream.string);
  if (found) stream.pos += found[0].length;
  return found && found[0];
}

/** Whether a pattern fits what comes next on the line. */
function ahead(stream, pattern) {
  pattern.lastIndex = stream.pos;
  return pattern.test(stream.string);
}

function named(stream, state, word) {
  const before = state.before;
  state.before = word;
  const inLook = state.look;  // `diffuse tex.grain` behind `material`
  if (word === "material") state.look = true;
  const known = KNOWN.get(word)?.find(({ after }) => ahead(stream, after));
  if (known) return known.tag;
  if (before in DEFINED) return DEFINED[before];
  if (inLook || ahead(stream, /\s*\{/y)) return "className";
  if (ahead(stream, /\s*\(/y)) return "variableName.function";
  return ahead(stream, /\s*=(?!=)/y) ? "propertyName" : "variableName";
}

function token(stream, state) {
  if (state.comment) {
    state.comment = !stream.skipTo("*/");
    if (state.comment) stream.skipToEnd();
    else stream.pos += 2;
    return "comment";
  }
  if (stream.eatSpace()) return null;
  if (take(stream, /\/\/.*/y)) return "comment";
  if (take(stream, /\/\*/y)) {
    state.comment = true;
    return token(stream, state);
  }
  const word = take(stream, TERMINAL.NAME);
  if (word) return named(stream, state, word);
  state.before = "";
  if (take(stream, TERMINAL.STRING)) return "string";
  if (take(stream, TERMINAL.NUMBER)) return "number";
  if (take(stream, TERMINAL.COLOR)) return "color";
  if (take(stream, SIGN)) return "operator";
  if (take(stream, /[()[\]{},;]/y)) return "punctuation";
  if (!take(stream, /[\w.#°]+|".*/y)) stream.next();
  return "invalid";
}

const scenes = StreamLanguage.define({
  name: "nsg",
  startState: () => ({ comment: false, before: "", depth: 0, look: false }),
  token(stream, state) {
    const found = token(stream, state);
    if (found === "punctuation") {
      state.look = false;
      if ("([{".includes(stream.current())) state.depth += 1;
      if (")]}".includes(stream.current())) state.depth = Math.max(0, state.depth - 1);
    }
    return found;
  },
  indent: (state, after, context) =>
    context.unit * Math.max(0, state.depth - Number(/^\s*[)\]}]/.test(after))),
  tokenTable: TAGS,
  languageData: {
    commentTokens: { line: "//", block: { open: "/*", close: "*/" } },
    closeBrackets: { brackets: ["(", "[", "{", '"'] },
    indentOnInput: /^\s*[)\]}]$/,
  },
});

const style = HighlightStyle.define([
  { tag: tags.comment, color: "var(--comment)", fontStyle: "italic" },
  { tag: [tags.definitionKeyword, tags.controlKeyword, tags.keyword, tags.modifier], color: "var(--keyword)" },
  { tag: [tags.number, tags.color, tags.bool, tags.atom], color: "var(--number)" },
  { tag: tags.string, color: "var(--string)" },
  { tag: [tags.className, tags.macroName], color: "var(--class)" },
  { tag: [tags.standard(tags.propertyName), tags.standard(tags.variableName)], color: "var(--call)" },
  { tag: tags.function(tags.variableName), color: "var(--call)" },
  { tag: [tags.special(tags.variableName)], color: "var(--number)", fontStyle: "italic" },
  { tag: [tags.definition(tags.variableName), tags.definition(tags.propertyName)], fontWeight: "600" },
  { tag: tags.invalid, color: "var(--error)" },
]);

/** What CodeMirror needs to know of scenes. */
export const scenelang = [scenes, syntaxHighlighting(style)];
