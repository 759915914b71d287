// The Markdown of the language server as nodes of the page: text stays text, pictures are PNG in data addresses.

import { element } from "./viewer/dom.js";

const INLINE = /`([^`]+)`|!\[([^\]]*)\]\((data:image\/png;base64,[A-Za-z0-9+/=]+)\)|\*\*([^*]+)\*\*/g;

function inline(parent, text) {
  let at = 0;
  for (const found of text.matchAll(INLINE)) {
    const [whole, code, alt, source, strong] = found;
    parent.append(text.slice(at, found.index));
    if (code !== undefined) parent.append(element("code", {}, code));
    else if (source !== undefined) parent.append(element("img", { alt, src: source }));
    else parent.append(element("strong", {}, strong));
    at = found.index + whole.length;
  }
  parent.append(text.slice(at));
  return parent;
}

function table(lines) {
  const rows = lines.filter((line) => !/^[|\s:-]+$/.test(line)).map((line) => {
    const cells = line.replace(/^\||\|$/g, "").split(/(?<!\\)\|/);
    return element("tr", {}, ...cells.map((cell) => inline(element("td"), cell.trim().replaceAll("\\|", "|"))));
  });
  return element("table", {}, ...rows);
}

function block(text) {
  const lines = text.split("\n");
  if (/^---+$/.test(text)) return element("hr");
  if (lines.every((line) => line.startsWith("|"))) return table(lines);
  if (lines.every((line) => line.startsWith("- "))) {
    return element("ul", {}, ...lines.map((line) => inline(element("li"), line.slice(2))));
  }
  return inline(element("p"), lines.join(" "));
}

/** A `div` that shows a text in Markdown: fences, lists, tables, code, strong, and pictures. */
export function markdown(text) {
  const shown = element("div", { class: "markdown" });
  text.split(/^```\w*\n([\s\S]*?)\n```/m).forEach((part, index) => {
    if (index % 2) shown.append(element("pre", {}, part));
    else shown.append(...part.split(/\n{2,}/).map((piece) => piece.trim()).filter(Boolean).map(block));
  });
  return shown;
}
