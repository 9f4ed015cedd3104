// Draws a picture with its mask and markers.

/** A pixel of the mask that passes the threshold; dilation adds others. */
const PASSED = 255;

/** Splits bytes into the line of JSON, the levels and the mask. */
export function taken(bytes) {
  const end = bytes.indexOf(10);
  const told = JSON.parse(new TextDecoder().decode(bytes.subarray(0, end)));
  const pixels = told.width * told.height;
  const levels = bytes.subarray(end + 1, end + 1 + 3 * pixels);
  return { told, levels, mask: bytes.subarray(end + 1 + 3 * pixels) };
}

/** Draws a picture with its markers and, if asked, its mask. */
export function paint(canvas, { told, levels, mask }, isMask) {
  canvas.width = told.width;
  canvas.height = told.height;
  const pen = canvas.getContext("2d");
  const image = pen.createImageData(told.width, told.height);
  for (let pixel = 0; pixel < mask.length; pixel += 1) {
    const strength = !isMask || mask[pixel] === 0 ? 0 : mask[pixel] === PASSED ? 0.6 : 0.3;
    const tint = [0, 255, 255];
    for (let c = 0; c < 3; c += 1) {
      image.data[4 * pixel + c] = levels[3 * pixel + c] * (1 - strength) + tint[c] * strength;
    }
    image.data[4 * pixel + 3] = 255;
  }
  pen.putImageData(image, 0, 0);
  drawMarkers(pen, told.markers ?? []);
}

function drawMarkers(pen, markers) {
  pen.strokeStyle = pen.fillStyle = "#ffff00";
  for (const { id, x, y } of markers) {
    pen.beginPath();
    pen.moveTo(x - 5, y);
    pen.lineTo(x + 6, y);
    pen.moveTo(x + 0.5, y - 5);
    pen.lineTo(x + 0.5, y + 6);
    pen.stroke();
    pen.fillText(id, x + 8, y - 8);
  }
}
