// What Python packed: JSON data and the arrays that it names.

const KINDS = {
  f32: Float32Array, i8: Int8Array, u8: Uint8Array, i16: Int16Array, u16: Uint16Array, i32: Int32Array,
};

/** Data with typed arrays in place of their names `[kind, offset, count]`, which lie in an ArrayBuffer. */
export function unpack(data, buffer) {
  if (Array.isArray(data)) {
    const Kind = data.length === 3 && typeof data[0] === "string" ? KINDS[data[0]] : undefined;
    return Kind ? new Kind(buffer, data[1], data[2]) : data.map((item) => unpack(item, buffer));
  }
  if (data === null || typeof data !== "object") return data;
  return Object.fromEntries(Object.entries(data).map(([name, value]) => [name, unpack(value, buffer)]));
}

export const WITH_ARRAYS = ["shader", "network", "shapes", "materials", "paints", "around"]; // parts of a view

/** The view of a message: data whose `blob` is deflated and in base64. */
export async function readView({ blob, ...view }) {
  const buffer = await inflated(blob).arrayBuffer();
  for (const part of WITH_ARRAYS) view[part] = unpack(view[part], buffer); // values of params may look like names
  return view;
}

/** What is deflated and in base64, as a Response. */
export function inflated(text) {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate")));
}

/** Values of a view's params by their names, as they are at first. */
export function defaultsOf(view) {
  return Object.fromEntries(view.params.map(({ name, value }) => [name, value]));
}

/** Whether two pieces of data are equal; typed arrays too. */
export function alike(a, b) {
  if (a === b) return true;
  if (typeof a !== "object" || typeof b !== "object" || a === null || b === null) return false;
  if (ArrayBuffer.isView(a)) {
    return a.constructor === b.constructor && a.length === b.length && a.every((value, at) => value === b[at]);
  }
  const keys = Object.keys(a);
  return keys.length === Object.keys(b).length && keys.every((key) => alike(a[key], b[key]));
}
