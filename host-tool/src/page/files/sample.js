// Samples as the page reads them.

/** Converts a sample of the stream to named values in mN, degrees and mm. */
export function named([sequence, frame, timeUs, status, row]) {
  const sample = { sequence, frame, seconds: timeUs / 1e6, status, force: null };
  if (row) {
    const [x, y, z, magnitude, magnitudeSigma, alpha, beta, directionSigma, place] = row;
    sample.force = {
      vector: [x / 1e3, y / 1e3, z / 1e3],
      magnitude: magnitude / 1e3,
      magnitudeSigma: magnitudeSigma / 1e3,
      alpha: alpha / 1e3,
      beta: beta / 1e3,
      directionSigma: directionSigma / 1e3,
      place: place && { x: place[0] / 1e3, y: place[1] / 1e3, sigma: place[2] / 1e3 },
    };
  }
  return sample;
}
