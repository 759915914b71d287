// Elements of the page. Texts of a scene are strangers': they go in as text, isolated, with no hidden signs.

const HIDDEN = /(?![\n\t])[\p{Cc}\p{Cf}\p{Cs}\p{Co}\p{Zl}\p{Zp}]/gu;

/** An element with properties (`class`, `aria-…` and `data-…` as attributes) and children, strings as text. */
export function element(tag, properties = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (/^(class|role|for|aria-.*|data-.*)$/.test(name)) made.setAttribute(name, value);
    else made[name] = value;
  }
  made.append(...children);
  return made;
}

/** The code point of a sign that is not seen, such as ⟨U+202E⟩. */
const named = (sign) => `⟨U+${sign.codePointAt(0).toString(16).toUpperCase().padStart(4, "0")}⟩`;

/** A text whose controls, marks of direction among them, are written out. */
export function plainText(text) {
  return text.replaceAll("\r\n", "\n").replace(HIDDEN, named);
}

/** A name from a scene, which does not change the direction of what is around it. */
export function isolated(text) {
  return element("bdi", {}, plainText(text));
}

/** A listing in which signs that are not seen stand out. */
export function listing(text) {
  const parts = [];
  let from = 0;
  const source = text.replaceAll("\r\n", "\n");
  for (const found of source.matchAll(HIDDEN)) {
    parts.push(source.slice(from, found.index), element("mark", {}, named(found[0])));
    from = found.index + found[0].length;
  }
  return element("pre", { tabIndex: 0, dir: "ltr" }, element("code", {}, ...parts, source.slice(from)));
}

/** A button that copies what `text()` gives, and says so. */
export function copyButton(label, text) {
  const button = element("button", { type: "button" }, label);
  button.addEventListener("click", async () => {
    const done = (await copied(text())) ? "Copied" : "Not copied: the browser refuses";
    button.textContent = done;
    setTimeout(() => (button.textContent = label), 1500);
  });
  return button;
}

/** Copy as a selection is, which a frame of its own may do too; elsewhere the clipboard is asked. */
async function copied(text) {
  const field = element("textarea", { value: text, class: "aside" });
  document.body.append(field);
  field.select();
  const done = document.execCommand("copy");
  field.remove();
  return done || navigator.clipboard.writeText(text).then(() => true, () => false);
}
