// Samples as the page reads them.

/**
 * Converts a sample of the stream to named values in mN, degrees, mm and mN·mm. `parts` has the
 * two contacts that the force is the sum of, if they are resolved.
 */
export function named([sequence, frame, timeUs, status, row, parts = []]) {
  const force = row && namedForce(row);
  return { sequence, frame, seconds: timeUs / 1e6, status, force, parts: parts.map(namedForce) };
}

function namedForce(row) {
  const [x, y, z, magnitude, magnitudeSigma, alpha, beta, directionSigma, place, torque] = row;
  return {
    vector: [x / 1e3, y / 1e3, z / 1e3],
    magnitude: magnitude / 1e3,
    magnitudeSigma: magnitudeSigma / 1e3,
    alpha: alpha / 1e3,
    beta: beta / 1e3,
    directionSigma: directionSigma / 1e3,
    place: place && { x: place[0] / 1e3, y: place[1] / 1e3, sigma: place[2] / 1e3 },
    torque: torque && { z: torque[0] / 1e3, sigma: torque[1] / 1e3 },
  };
}
