// What Python packed: JSON data and the arrays that it names.

const KINDS = {
  f32: Float32Array, u8: Uint8Array, i16: Int16Array, u16: Uint16Array, i32: Int32Array,
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

/** The view of a message: data whose `blob` is deflated and in base64. */
export async function readView(message) {
  const { blob, ...data } = message;
  const bytes = Uint8Array.from(atob(blob), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  const buffer = await new Response(stream).arrayBuffer();
  const { form, source, ...rest } = data; // texts and trees name no arrays
  return { ...unpack(rest, buffer), form, source };
}
