// Colour scales: where on the ramp a value is, and what the ramp says.

const TICKS = [0, 0.25, 0.5, 0.75, 1];

// 0 to 1.
function place(value, scale, how) {
  const { low_W_m2: low, top_W_m2: top, quantiles_W_m2: knots } = scale;
  if (!(value > 0) || !(top > 0)) return 0;
  if (how === 'linear') return Math.min(1, value / top);
  if (how === 'log') return value > low ? Math.min(1, Math.log(value / low) / Math.log(top / low)) : 0;
  // the part of the area that is darker, between two quantiles in proportion
  let [from, to] = [0, knots.length - 1];
  if (value >= knots[to]) return 1;
  while (to - from > 1) {
    const middle = (from + to) >> 1;
    if (knots[middle] <= value) from = middle; else to = middle;
  }
  const step = knots[to] - knots[from];
  const within = step > 0 ? Math.max(0, (value - knots[from]) / step) : 0;
  return (from + within) / (knots.length - 1);
}

// The value that is there.
function valueAt(part, scale, how) {
  const { low_W_m2: low, top_W_m2: top, quantiles_W_m2: knots } = scale;
  if (how === 'linear' || !(top > 0)) return top * part;
  if (how === 'log') return low * (top / low) ** part;
  return knots[Math.round(part * (knots.length - 1))];
}

// What the ends of a ramp stand for: what is beyond them has their colours.
function tickText(part, scale, how) {
  const value = figure(valueAt(part, scale, how), 3);
  if (part === 1) return `≥ ${value}`;
  return part === 0 && how === 'log' ? `≤ ${value}` : value;
}
