// Numbers of axes. This code precedes the modules that draw axes.
const LARGEST = 1e12; // minimum axis number that is written with an exponent

// Return round values between two limits, with the text of each value.
function ticks(low, high, wanted) {
  const rough = (high - low) / Math.max(wanted, 1);
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 5, 10].find((k) => k * power >= rough);
  const decimals = clamp(-Math.floor(Math.log10(step) + 1e-9), 0, 20);
  const out = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + step * 1e-6; k++) {
    const text = Math.abs(k * step) < LARGEST ? (k * step).toFixed(decimals) : String(k * step);
    out.push({ at: k * step, text });
  }
  return out;
}
