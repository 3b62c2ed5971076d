// Numbers as text, tables and drawings.

const AND = { '&': '&amp;', '<': '&lt;', '>': '&gt;', '"': '&quot;' };

function html(text) {
  return String(text).replace(/[&<>"]/g, (character) => AND[character]);
}

// With as many digits as mean something.
function figure(value, digits = 4) {
  if (value === 0) return '0';
  const size = Math.abs(value);
  if (size < 1e-4 || size >= 1e6) return value.toExponential(2);
  return value.toFixed(Math.max(0, Math.min(8, digits - 1 - Math.floor(Math.log10(size)))));
}

// A value and its standard error to the same decimal, the error to two digits.
function withError(value, se) {
  if (!(se > 0)) return figure(value);
  const decimals = Math.max(0, Math.min(8, 1 - Math.floor(Math.log10(se))));
  const error = se.toFixed(decimals);
  if (Number(error) === 0) return figure(value);
  return `${value.toFixed(decimals)} <span class="se">± ${error}</span>`;
}

function table(heading, rows) {
  const line = (cells, tag) => `<tr>${cells.map((cell) => `<${tag}>${cell}</${tag}>`).join('')}</tr>`;
  return `<div class="wide"><table>${line(heading, 'th')}${rows.map((row) => line(row, 'td')).join('')}</table></div>`;
}

// The next round number.
function roundTop(value) {
  if (!(value > 0)) return 1;
  const power = 10 ** Math.floor(Math.log10(value));
  return [1, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10].map((k) => k * power).find((top) => top >= value * 0.999999);
}

// Bars along the height, under a title in HTML. layers: {low_m, high_m}; parts: lists of values with a class
// each, end to end.
function heightChart(title, unit, layers, parts) {
  const [width, height, left, top, bottom] = [300, 240, 42, 8, 34];
  const low = layers[0].low_m;
  const span = layers[layers.length - 1].high_m - low || 1;
  const totals = layers.map((_, k) => parts.reduce((sum, part) => sum + part.values[k], 0));
  const most = roundTop(Math.max(...totals));
  const inside = height - top - bottom;
  const y = (z) => top + inside * (1 - (z - low) / span);
  const x = (value) => left + (width - left - 12) * value / most;
  let shapes = '';
  layers.forEach((layer, k) => {
    let from = 0;
    for (const part of parts) {
      const to = from + Math.max(0, part.values[k]);
      const thick = Math.max(1, y(layer.low_m) - y(layer.high_m) - 1);
      shapes += `<rect class="${part.look}" x="${x(from)}" y="${y(layer.high_m)}" width="${x(to) - x(from)}" height="${thick}"><title>${figure(layer.low_m, 3)} to ${figure(layer.high_m, 3)} m: ${figure(part.values[k])} ${unit}</title></rect>`;
      from = to;
    }
  });
  for (const part of [0, 0.5, 1]) {
    shapes += `<text x="${x(most * part)}" y="${height - bottom + 14}" text-anchor="middle">${figure(most * part, 2)}</text>`;
    shapes += `<text x="${left - 5}" y="${y(low + span * part) + 4}" text-anchor="end">${(low + span * part).toFixed(2)}</text>`;
  }
  shapes += `<path class="axis" fill="none" d="M${left} ${top}V${height - bottom}H${width - 12}"/>`;
  shapes += `<text x="${(left + width - 12) / 2}" y="${height - 4}" text-anchor="middle">${html(unit)}</text>`;
  return `<figure style="margin:0"><h3>${title}</h3><svg viewBox="0 0 ${width} ${height}" role="img" aria-label="by height, ${unit}">${shapes}</svg></figure>`;
}

// One bar a band with its standard error.
function errorBars(rows, unit) {
  const [width, left, right, step] = [300, 52, 10, 26];
  const most = roundTop(Math.max(...rows.map((row) => row.value + row.se)));
  const x = (value) => left + (width - left - right) * Math.max(0, Math.min(1, value / most));
  let shapes = '';
  rows.forEach((row, k) => {
    const y = k * step + 4;
    const [from, to, middle] = [x(row.value - row.se), x(row.value + row.se), y + 8];
    shapes += `<text x="${left - 6}" y="${y + 12}" text-anchor="end">${html(row.name.slice(0, 8))}</text>`;
    shapes += `<rect class="bar" x="${left}" y="${y}" width="${x(row.value) - left}" height="16"/>`;
    shapes += `<path class="error" d="M${from} ${middle}H${to}M${from} ${y + 3}v10M${to} ${y + 3}v10"/>`;
  });
  const bottom = rows.length * step + 4;
  shapes += `<path class="axis" d="M${left} ${bottom}H${width - right}"/>`;
  shapes += `<text x="${left}" y="${bottom + 14}">0</text>`;
  shapes += `<text x="${width - right}" y="${bottom + 14}" text-anchor="end">${figure(most, 2)} ${unit}</text>`;
  return `<svg viewBox="0 0 ${width} ${bottom + 20}" role="img" aria-label="absorbed light with standard errors">${shapes}</svg>`;
}
