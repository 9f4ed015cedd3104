// Bytes that lie in a script as text: seven bits a character, which is an eighth less than base64.

/** Reads bytes from text, the highest bits first. Characters that no text holds have 128 added. */
export function bytesOf(text) {
  const bytes = new Uint8Array(Math.floor(text.length * 7 / 8));
  let bits = 0;
  let count = 0;
  let at = 0;
  for (let k = 0; k < text.length; k += 1) {
    bits = (bits & 127) << 7 | text.charCodeAt(k) & 127;
    count += 7;
    if (count >= 8) {
      count -= 8;
      bytes[at] = bits >> count;
      at += 1;
    }
  }
  return bytes;
}
