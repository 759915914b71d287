// Lines of letters, set as assets/element_file.py does. A font of a form has `letters` by character: the shape
// (-1 for one that shows nothing), its advance, and the middle and radius of its disc; and kerning by `pairs`; em.

import { bare, kindOf, refuse } from "./values.js";

const ALIGNED = { left: 0, center: 0.5, right: 1 };

/** Characters of a text, where a letter and its marks are one that the font has for them. */
const composed = (text, letters) => (text.match(/.[\p{M}\u1160-\u11ff]*/gsu) ?? []).flatMap((part) => {
  const whole = [...part.normalize("NFC")];
  return whole.every((letter) => Object.hasOwn(letters, letter)) ? whole : [...part];
});

/** The letters of a text, `{shape, x, y, radius}`, and its width. */
export function lineOf({ letters, pairs }, text, size = 1, align = "left") {
  if (typeof text !== "string") refuse(`expected a string, found ${kindOf(text)}`);
  const em = bare(size), line = [];
  if (!(em > 0)) refuse("a text whose size is not above 0");
  if (!Object.hasOwn(ALIGNED, align)) refuse("a text that is aligned to nothing");
  let pen = 0, last = "";
  for (const letter of composed(text, letters)) {
    if (!Object.hasOwn(letters, letter)) refuse(`the page does not have the letter \`${letter}\``);
    const [shape, advance, x, y, radius] = letters[letter];
    pen += pairs[last + letter] ?? 0;
    if (shape >= 0) line.push({ shape, x: pen + x, y, radius: em * radius });
    pen += advance;
    last = letter;
  }
  const left = ALIGNED[align] * pen;
  return { line: line.map((one) => ({ ...one, x: em * (one.x - left), y: em * one.y })), width: em * pen };
}
