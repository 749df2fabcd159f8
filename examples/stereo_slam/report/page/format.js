const kMissing = '–';

/// A number with `digits` significant digits and no exponent where that is readable; a dash if there is none.
export function number(value, digits = 3) {
  if (value == null || !Number.isFinite(value)) return kMissing;
  const size = Math.abs(value);
  if (size !== 0 && (size < 1e-5 || size >= 1e7)) return value.toExponential(digits - 1);
  const decimals = size === 0 ? 0 : Math.max(0, digits - 1 - Math.floor(Math.log10(size)));
  return value.toFixed(Math.min(decimals, 8));
}

export function fixed(value, decimals) {
  return value == null || !Number.isFinite(value) ? kMissing : value.toFixed(decimals);
}

export function metres(value) {
  if (value == null || !Number.isFinite(value)) return kMissing;
  return value < 1000 ? `${value.toFixed(1)} m` : `${(value / 1000).toFixed(2)} km`;
}

/// A standard deviation with the unit that makes it readable.
export function sigmaMetres(value) {
  if (value == null || !Number.isFinite(value)) return kMissing;
  return value < 0.01 ? `${number(1000 * value, 2)} mm` : value < 1 ? `${number(100 * value, 2)} cm` : `${number(value, 3)} m`;
}

export function seconds(value) {
  if (value == null || !Number.isFinite(value)) return kMissing;
  if (value < 120) return `${value.toFixed(value < 10 ? 2 : 1)} s`;
  const minutes = Math.floor(value / 60);
  return `${minutes} min ${Math.round(value - 60 * minutes)} s`;
}

export function count(value, one, many = `${one}s`) {
  return `${value} ${value === 1 ? one : many}`;
}
