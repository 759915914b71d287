// The statements of a scene's text, as far as changing one takes: where each begins and ends, and its first word.

const PIECE = /\/\/.*|\/\*[\s\S]*?(?:\*\/|$)|"(?:[^"\\\n]|\\.)*"?|\w+|[()[\]{};]/g;
const HEAD = ["nsg", "model", "import", "param", "canvas", "animate", "background", "camera", "light", "ground"];

/** The statements at the top level of a text: `{word, from, to}` each, offsets in UTF-16 units. */
export function statements(text) {
  const found = [];
  let depth = 0;
  let now = null;
  for (const { 0: piece, index } of text.matchAll(PIECE)) {
    if (piece.startsWith("//") || piece.startsWith("/*")) continue;
    if (")]}".includes(piece)) depth -= 1;
    const ends = depth <= 0 && (piece === ";" || piece === "}");
    if (now === null && !ends) now = { word: piece, from: index };
    if ("([{".includes(piece)) depth += 1;
    if (now !== null && ends) {
      found.push({ ...now, to: index + 1 });
      now = null;
    }
    if (ends) depth = 0;
  }
  return found;
}

/** The change of a text that gives it this line as its only `word(…)`, behind its other settings if it had none. */
export function settled(text, word, line) {
  const all = statements(text);
  const old = all.findLast((statement) => statement.word === word);
  if (old) return { from: old.from, to: old.to, insert: line };
  const first = all.findIndex((statement) => !HEAD.includes(statement.word));
  const before = all[(first < 0 ? all.length : first) - 1];
  if (!before) return { from: 0, insert: `${line}\n` };
  const stop = text.indexOf("\n", before.to);  // behind a comment of the same line
  const at = stop < 0 || /\S/.test(text.slice(before.to, stop).replace(/\/\/.*/, "")) ? before.to : stop;
  return { from: at, insert: `\n${line}` };
}

/** The one change that makes `before` into `after`. */
export function difference(before, after) {
  const most = Math.min(before.length, after.length);
  let head = 0;
  while (head < most && before[head] === after[head]) head += 1;
  let tail = 0;
  while (tail < most - head && before.at(-1 - tail) === after.at(-1 - tail)) tail += 1;
  return { from: head, to: before.length - tail, insert: after.slice(head, after.length - tail) };
}
