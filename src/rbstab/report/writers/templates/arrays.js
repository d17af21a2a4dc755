// Arrays of numbers, packed in base64.

const KINDS = { f4: Float32Array, i4: Int32Array };

/** Return the numbers of a packed array, row by row. */
function flat({ dtype, bdata }) {
  const bytes = Uint8Array.from(atob(bdata), (letter) => letter.charCodeAt(0));
  return new KINDS[dtype](bytes.buffer);
}
