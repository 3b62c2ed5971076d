// Numbers as text, tables and drawings.

const AND = { '&': '&amp;', '<': '&lt;', '>': '&gt;', '"': '&quot;' };

function html(text) {
  return String(text).replace(/[&<>"]/g, (character) => AND[character]);
}

// With so many decimals. What rounds to zero has no sign.
function fixed(value, decimals) {
  const text = value.toFixed(decimals);
  return Number(text) === 0 ? text.replace('-', '') : text;
}

// With as many digits as mean something.
function figure(value, digits = 4) {
  if (value === 0) return '0';
  const size = Math.abs(value);
  if (size < 1e-4 || size >= 1e6) return value.toExponential(digits - 2);
  return fixed(value, Math.max(0, Math.min(8, digits - 1 - Math.floor(Math.log10(size)))));
}

// A value and its standard error to the same decimal, the error to two digits.
function withError(value, se) {
  if (!(se > 0)) return figure(value);
  const decimals = Math.max(0, Math.min(8, 1 - Math.floor(Math.log10(se))));
  const error = fixed(se, decimals);
  if (Number(error) === 0) return figure(value);
  return `${fixed(value, decimals)} <span class="se">± ${error}</span>`;
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
  const [width, height, top, bottom] = [300, 240, 8, 34];
  const low = layers[0].low_m;
  const span = layers[layers.length - 1].high_m - low || 1;
  const decimals = Math.max(0, Math.min(6, 2 - Math.floor(Math.log10(span))));
  const heights = [0, 0.5, 1].map((part) => fixed(low + span * part, decimals));
  // room for the longest of them
  const left = 12 + 6.5 * Math.max(...heights.map((text) => text.length));
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
  [0, 0.5, 1].forEach((part, k) => {
    const anchor = ['start', 'middle', 'end'][k];
    shapes += `<text x="${x(most * part)}" y="${height - bottom + 14}" text-anchor="${anchor}">${figure(most * part, 2)}</text>`;
    shapes += `<text x="${left - 5}" y="${y(low + span * part) + 4}" text-anchor="end">${heights[k]}</text>`;
  });
  shapes += `<path class="axis" fill="none" d="M${left} ${top}V${height - bottom}H${width - 12}"/>`;
  shapes += `<text x="${(left + width - 12) / 2}" y="${height - 4}" text-anchor="middle">${html(unit)}</text>`;
  return `<figure><h3>${title}</h3><svg viewBox="0 0 ${width} ${height}" role="img" aria-label="by height, ${unit}">${shapes}</svg></figure>`;
}

// One bar a band with its standard error; names and numbers are text, which wraps as it must.
function errorBars(rows) {
  const most = roundTop(Math.max(...rows.map((row) => row.value + row.se)));
  const part = (value) => 100 * Math.max(0, Math.min(1, value / most));
  return rows.map((row) => {
    const [from, to] = [part(row.value - row.se), part(row.value + row.se)];
    return `<div class="barred"><span>${html(row.name)}</span><span>${withError(row.value, row.se)}</span>` +
      `<div class="track"><div class="fill" style="width:${part(row.value)}%"></div>` +
      `<div class="whisker" style="left:${from}%;width:${to - from}%"></div></div></div>`;
  }).join('');
}
