/// The round number (1, 2 or 5 times a power of ten) nearest to a value > 0.
export function roundStep(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  const digits = value / power;
  return power * (digits < 1.5 ? 1 : digits < 3.5 ? 2 : digits < 7.5 ? 5 : 10);
}

export function stepText(step_m) {
  if (step_m >= 1000) return `${step_m / 1000} km`;
  return step_m >= 1 ? `${step_m} m` : `${Number((100 * step_m).toPrecision(1))} cm`;
}

/// A round factor, at least one, by which ellipsoids are enlarged so that the largest half axis is a fifteenth of the scene.
export function ellipsoidScale(ellipsoids, extent_m) {
  const largest = ellipsoids.reduce((most, ellipsoid) => Math.max(most, ...ellipsoid.half_axes), 0);
  return [2, 5, 10, 20, 50, 100, 200, 500, 1000].reduce((best, factor) => (factor * largest <= extent_m / 15 ? factor : best), 1);
}

/// The largest side of the box around positions [x, y, z, ...].
export function extentOf(positions) {
  const low = [Infinity, Infinity, Infinity];
  const high = [-Infinity, -Infinity, -Infinity];
  positions.forEach((value, i) => {
    if (!Number.isFinite(value)) return;
    low[i % 3] = Math.min(low[i % 3], value);
    high[i % 3] = Math.max(high[i % 3], value);
  });
  return Math.max(1, ...high.map((value, i) => (value >= low[i] ? value - low[i] : 0)));
}
