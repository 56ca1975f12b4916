/** Numbers and units as people read them. */

/** So many significant digits, without an exponent where that is readable. */
export function text(value: number, digits = 3): string {
  if (!Number.isFinite(value)) return Number.isNaN(value) ? "–" : value > 0 ? "∞" : "−∞";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e6 || size < 1e-4) {
    const [mantissa, exponent] = value.toExponential(digits - 1).split("e");
    return `${minus(mantissa)} × 10${superscript(Number(exponent))}`;
  }
  const decimals = Math.max(0, digits - 1 - Math.floor(Math.log10(size)));
  return minus(
    value.toLocaleString("en", { maximumFractionDigits: decimals, minimumFractionDigits: decimals }),
  );
}

const minus = (written: string): string => written.replace("-", "−");

function superscript(number: number): string {
  return minus(String(number)).replace(/[−0-9]/g, (digit) => "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"["−0123456789".indexOf(digit)]);
}

/** A value and its standard error, to the error's second digit. */
export function withError(value: number, error: number): string {
  if (!Number.isFinite(error) || error <= 0) return text(value);
  const decimals = Math.max(0, 1 - Math.floor(Math.log10(error)));
  if (decimals > 8 || Math.abs(value) >= 1e6) return `${text(value)} ± ${text(error, 2)}`;
  return `${minus(value.toFixed(decimals))} ± ${error.toFixed(decimals)}`;
}

export const count = (number: number): string => number.toLocaleString("en");

/** A unit of length to a power, in words of a legend; "" for a number without one. */
export function unitText(unit: string, power: number): string {
  if (power === 0) return "";
  const name = unit === "unit" ? "unit" : unit;
  if (power === 1) return name;
  return power === -1 ? `1/${name}` : `1/${name}²`;
}

/** The 97.5 % quantile of Student's t, by bisection of its distribution. */
export function studentT(freedom: number): number {
  if (!(freedom > 0)) return NaN;
  let [low, high] = [0, 1];
  while (studentTail(high, freedom) > 0.025) high *= 2;
  for (let i = 0; i < 80; i++) {
    const middle = (low + high) / 2;
    if (studentTail(middle, freedom) > 0.025) low = middle;
    else high = middle;
  }
  return (low + high) / 2;
}

/** P(T > t) = I_x(v / 2, 1 / 2) / 2 with x = v / (v + t^2). */
function studentTail(t: number, freedom: number): number {
  return 0.5 * incompleteBeta(freedom / (freedom + t * t), freedom / 2, 0.5);
}

/** The regularised incomplete beta function by its continued fraction (Lentz). */
function incompleteBeta(x: number, a: number, b: number): number {
  if (x <= 0) return 0;
  if (x >= 1) return 1;
  if (x > (a + 1) / (a + b + 2)) return 1 - incompleteBeta(1 - x, b, a);
  const front =
    Math.exp(logGamma(a + b) - logGamma(a) - logGamma(b) + a * Math.log(x) + b * Math.log(1 - x)) / a;
  const tiny = 1e-300;
  let [c, d] = [1, 1 / keepAway(1 - ((a + b) * x) / (a + 1), tiny)];
  let fraction = d;
  for (let m = 1; m <= 400; m++) {
    const even = (m * (b - m) * x) / ((a + 2 * m - 1) * (a + 2 * m));
    d = 1 / keepAway(1 + even * d, tiny);
    c = keepAway(1 + even / c, tiny);
    fraction *= d * c;
    const odd = (-(a + m) * (a + b + m) * x) / ((a + 2 * m) * (a + 2 * m + 1));
    d = 1 / keepAway(1 + odd * d, tiny);
    c = keepAway(1 + odd / c, tiny);
    fraction *= d * c;
    if (Math.abs(d * c - 1) < 1e-14) break;
  }
  return front * fraction;
}

const keepAway = (value: number, tiny: number): number => (Math.abs(value) < tiny ? tiny : value);

/** Lanczos' approximation. */
function logGamma(x: number): number {
  const g = [
    76.18009172947146, -86.50532032941677, 24.01409824083091, -1.231739572450155, 1.208650973866179e-3,
    -5.395239384953e-6,
  ];
  const shifted = x + 5.5 - (x + 0.5) * Math.log(x + 5.5);
  const series = g.reduce((sum, value, i) => sum + value / (x + 1 + i), 1.000000000190015);
  return Math.log((2.5066282746310005 * series) / x) - shifted;
}
