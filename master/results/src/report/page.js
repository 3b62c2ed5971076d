// The page: reads what is in it, and shows it.

const report = JSON.parse(document.getElementById('report').textContent);
const element = (id) => document.getElementById(id);

function numbers(id, Kind) {
  const node = element(id);
  const text = atob(node.textContent);
  const bytes = new Uint8Array(text.length);
  for (let k = 0; k < text.length; k++) bytes[k] = text.charCodeAt(k);
  // the text is not needed any more, and may be large
  node.remove();
  return new Kind(bytes.buffer);
}

const state = { band: 0, by: 'triangle', scaling: 'log', picked: -1, view: null, absorbed: [], organs: null };

// Values of the drawing in W per m² of leaf, per triangle.
function shownValues() {
  const own = state.absorbed[state.band];
  if (state.by === 'triangle') return own;
  const means = report.organs.map((organ) => (organ.area_m2 > 0 ? organ.light[state.band].absorbed_W / organ.area_m2 : 0));
  return Float32Array.from(state.organs, (organ) => means[organ]);
}

function recolour() {
  const scale = report.scales[state.band][state.by];
  const how = state.scaling;
  const soil = report.soil ? report.soil.irradiance_W_m2[state.band] : [];
  const most = soil.reduce((a, b) => Math.max(a, b), 0);
  const ticks = TICKS.map((part) => `<span>${tickText(part, scale, how)}</span>`);
  const each = state.by === 'triangle' ? '' : ', mean of an organ';
  const note = { log: 'logarithmic', linear: 'linear', quantiles: 'each colour has an equal leaf area' }[how];
  element('scale').innerHTML = `<div class="ramp"><div style="background:linear-gradient(to right,${COLOURS.join(',')})"></div>` +
    `<p>${ticks.join('')}</p></div><p>W absorbed per m² of leaf in ${html(report.bands[state.band])}${each} <span class="se">(${note})</span>` +
    `${most > 0 ? `<br><span class="se">soil, dark to light: 0 to ${figure(most, 3)} W m⁻² arriving</span>` : ''}</p>`;
  if (!state.view) return;
  state.view.show(shownValues().map((value) => place(value, scale, how)), soil.map((value) => (most > 0 ? value / most : 0)));
}

function pick(organ) {
  state.picked = organ;
  if (state.view) {
    state.view.picked = organ;
    state.view.redraw();
  }
  showPicked();
}

const manySpecies = new Set(report.organs.map((organ) => organ.species)).size > 1;

// Species are named where there are several.
function organName(organ) {
  return `${manySpecies ? `species ${organ.species}, ` : ''}plant ${organ.plant}, organ ${organ.organ}`;
}

function showPicked() {
  const panel = element('picked');
  const organ = report.organs[state.picked];
  if (!organ) {
    const options = report.organs.length > 5000 ? '' : report.organs
      .map((o, k) => `<option value="${k}">${html(organName(o))}</option>`).join('');
    panel.innerHTML = '<h3>An organ’s numbers</h3><p class="hint">Click a leaf in the drawing' +
      (options ? `, or choose one:</p><select id="choose"><option value="-1">—</option>${options}</select>` : '.</p>');
    if (options) element('choose').addEventListener('change', (event) => pick(Number(event.target.value)));
    return;
  }
  const per = (value) => (organ.area_m2 > 0 ? value / organ.area_m2 : 0);
  const rows = organ.light.map((light, band) => ({ name: report.bands[band], value: per(light.absorbed_W), se: per(light.se_W) }));
  const line = (what, value, unit) => `<tr><td>${what}</td><td>${value} ${unit}</td></tr>`;
  const lines = organ.light.map((light, band) => `<tr><th colspan="2">${html(report.bands[band])}</th></tr>` +
    line('absorbed', withError(light.absorbed_W, light.se_W), 'W') +
    line('straight from sources', figure(light.direct_W), 'W') +
    line('on the upper face', figure(light.upper_W_m2), 'W m⁻²') +
    line('on the lower face', figure(light.lower_W_m2), 'W m⁻²')).join('');
  const name = organName(organ);
  panel.innerHTML = `<h3>${html(name[0].toUpperCase() + name.slice(1))}</h3>` +
    `<p class="hint">${html(organ.kind)}, ${figure(organ.area_m2 * 1e4)} cm², one-sided</p>` +
    `<p class="hint">Absorbed, W per m² of this organ, ± one standard error</p>${errorBars(rows)}` +
    `<table>${lines}</table><p><button type="button" id="unpick">Choose another</button></p>`;
  element('unpick').addEventListener('click', () => pick(-1));
}

// Leaf area that is lit, per layer.
function litArea(layer, band, threshold) {
  return layer.by_direct_m2[band].slice(threshold).reduce((a, b) => a + b, 0);
}

// What areas and powers are divided by, if the ground has an area: a wall that stands alone has none.
const ground = report.ground_m[0] * report.ground_m[1];
const groundName = report.periodic ? 'the pattern' : 'the box around the scene';
const groundSize = report.ground_m.map((side) => `${figure(side, 3)} m`).join(' x ');

function showProfiles() {
  const { layers, bands } = report;
  if (!layers.length) return;
  const divisor = ground > 0 ? ground : 1;
  const per = ground > 0 ? ' per m² of ground' : '';
  const from = Number(element('threshold').value);
  const lit = layers.map((layer) => litArea(layer, state.band, from) / divisor);
  const shade = layers.map((layer, k) => layer.area_m2 / divisor - lit[k]);
  element('profiles').innerHTML = heightChart(`Leaf area: <span class="key lit">lit</span> and <span class="key shade">shaded</span>`,
    `m² of leaf${per}`, layers, [{ look: 'lit', values: lit }, { look: 'shade', values: shade }]) +
    bands.map((band, b) => heightChart(`Absorbed in ${html(band)}`, `W${per}`, layers,
      [{ look: 'bar', values: layers.map((layer) => layer.absorbed_W[b] / divisor) }])).join('');
  const area = layers.reduce((sum, layer) => sum + layer.area_m2, 0);
  element('profile-note').textContent = `In ${layers.length} layers of equal height (m, upwards); a triangle counts where its centre is. ` +
    `${ground > 0 ? `Ground is ${groundName}, ${groundSize}. ` : ''}Lit and shaded are for ${bands[state.band]}.`;
  element('threshold-value').textContent = `${fixed(from * report.lit_step * 100, 1)} %`;
  element('lit').innerHTML = table(['band', 'lit, m²', 'shaded, m²', 'lit', ''], bands.map((band, b) => {
    const own = layers.reduce((sum, layer) => sum + litArea(layer, b, from), 0);
    const part = area > 0 ? own / area : 0;
    return [html(band), figure(own), figure(area - own), `${fixed(part * 100, 1)} %`,
      `<div class="share"><span class="lit" style="width:${part * 100}%"></span><span class="shade"></span></div>`];
  }));
}

function showBalance() {
  const flows = [['absorbed by plants', 'absorbed_plants_W'], ['… by leaves', 'absorbed_leaves_W'], ['… by stems', 'absorbed_stems_W'],
    ['absorbed by structures', 'absorbed_structures_W'], ['absorbed by the soil', 'absorbed_soil_W'],
    ['escaped upwards', 'escaped_up_W'], ['escaped downwards', 'escaped_down_W'],
    ['scattered, not followed', 'scattered_W'], ['closure', 'closure_W']];
  // where the canopy repeats, per ground; a scene that stands alone, as a whole
  const divisor = report.periodic ? ground : 1;
  const part = (value, of) => (of > 0 ? ` <span class="se">(${fixed(100 * value / of, 2)} %)</span>` : '');
  const rows = [['incoming', ...report.balance.map((b) => figure(b.incoming_W / divisor, 5))]];
  // what is nothing in all bands is not worth a line; closure always is
  const matters = (key) => key === 'closure_W' || report.balance.some((b) => Math.abs(b[key].value) > 1e-6 * b.incoming_W);
  for (const [title, key] of flows.filter((flow) => matters(flow[1]))) {
    rows.push([title, ...report.balance.map((b) => withError(b[key].value / divisor, b[key].se / divisor) + part(b[key].value, b.incoming_W))]);
  }
  element('balance').innerHTML = table([report.periodic ? 'W per m² of ground' : 'W, whole scene', ...report.balance.map((b) => html(b.band))], rows) +
    ofMaterials(divisor, part) +
    '<p class="hint">± one standard error. Closure is incoming light minus absorbed and escaped light. Nothing is scaled to make it zero, so it should be within a few of its own standard errors.</p>';
}

// What each material absorbs, where there are several.
function ofMaterials(divisor, part) {
  const { materials } = report.balance[0];
  if (materials.length < 2) return '';
  const order = ['leaf', 'stem', 'structure', 'soil'];
  const numbers = materials.map((_, m) => m).sort((a, b) => order.indexOf(materials[a].kind) - order.indexOf(materials[b].kind) || a - b);
  return table(['absorbed by', 'kind', ...report.balance.map((b) => html(b.band))], numbers.map((m) => [html(materials[m].name), materials[m].kind,
    ...report.balance.map((b) => { const { value, se } = b.materials[m].absorbed_W; return withError(value / divisor, se / divisor) + part(value, b.incoming_W); })]));
}

function showErrors() {
  element('errors').innerHTML = table(['band', 'standard error of organs', 'closure in its own standard errors'], report.errors.map((error, k) => {
    const closure = report.balance[k].closure_W;
    const rms = error.rms_percent === null ? '—' : `${fixed(error.rms_percent, 2)} %`;
    return [html(error.band), rms, closure.se > 0 ? fixed(Math.abs(closure.value) / closure.se, 1) : '—'];
  })) + `<p class="hint">Root mean square over all organs, in percent of the mean absorbed per leaf area; target (--accuracy): ${report.accuracy_percent} %. A triangle’s error is larger than its organ’s.</p>` + errorParts();
}

// what is nothing in all bands is not worth a column
function errorParts() {
  const parts = [['exchange', 'exchange_percent'], ['direct light', 'direct_percent'], ['sky directions', 'sky_percent'],
    ['element size', 'elements_percent'], ['soil cell size', 'soil_percent'], ['far field', 'far_field_percent'], ['solver', 'solver_percent']];
  const shown = parts.filter(([, key]) => report.account.some((part) => part[key] >= 0.005));
  if (shown.length === 0) return '';
  return table(['parts of the error, %', ...shown.map(([name]) => name)],
    report.account.map((part) => [html(part.band), ...shown.map(([, key]) => fixed(part[key], 2))])) +
    '<p class="hint">The standard error includes the sampling of exchange and direct light only. The other parts are not in it.</p>';
}

function showFacts() {
  const { plants, organs, triangles, sources, version, resources, seed } = report;
  const index = report.area_index === null ? '' : ` · area index ${figure(report.area_index, 3)} (one-sided area of leaves and stems, per area of ${groundName}, ${groundSize})`;
  element('facts').textContent = `${plants} plants, ${organs.length} organs, ${triangles.toLocaleString('en')} triangles${index} · ${report.light} (${sources} sources)`;
  element('reasons').innerHTML = report.reasons.map((reason) => `<li>${html(reason)}</li>`).join('');
  element('cost').textContent = `nestrad ${version}, seed ${seed}; ${figure(resources.wall_s, 3)} s elapsed, ${figure(resources.cpu_s, 3)} s of CPU time.`;
}

function startView() {
  if (report.not_drawn) throw new Error(report.not_drawn);
  const vertices = numbers('vertices', Float32Array);
  state.organs = numbers('organs', Uint32Array);
  state.absorbed = report.bands.map((_, band) => numbers(`absorbed-${band}`, Float32Array));
  const soil = report.soil && report.soil_z_m !== null ? soilTriangles(report.soil, report.soil_z_m, report.origin_m) : new Float32Array(0);
  state.view = new View(element('canvas'), vertices, state.organs, soil);
  state.view.onpick = pick;
}

// For the test in a browser, #selftest=ORGAN: draws, finds the organ where its triangles are, clicks it.
function selftest(wanted) {
  const view = state.view;
  if (!view) return { error: element('message').textContent };
  view.draw();
  const { gl, canvas, vertices } = view;
  const pixels = new Uint8Array(canvas.width * canvas.height * 4);
  gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  const colours = new Set();
  let drawn = 0;
  for (let k = 0; k < pixels.length; k += 4) {
    if (pixels[k + 3] > 0) {
      drawn += 1;
      colours.add(pixels[k] * 65536 + pixels[k + 1] * 256 + pixels[k + 2]);
    }
  }
  for (let t = 0; t < view.own; t++) {
    if (state.organs[t] !== wanted) continue;
    const centre = [0, 1, 2].map((k) => (vertices[9 * t + k] + vertices[9 * t + 3 + k] + vertices[9 * t + 6 + k]) / 3);
    const at = project(view.matrix(), centre, canvas.clientWidth, canvas.clientHeight);
    if (at && view.organAt(...at) === wanted) {
      const event = (type) => new PointerEvent(type, { pointerId: 1, clientX: at[0] + canvas.getBoundingClientRect().x + canvas.clientLeft, clientY: at[1] + canvas.getBoundingClientRect().y + canvas.clientTop });
      // a made-up pointer cannot be captured
      canvas.setPointerCapture = () => {};
      canvas.dispatchEvent(event('pointerdown'));
      canvas.dispatchEvent(event('pointerup'));
      break;
    }
  }
  // what the picture says in each way of colouring: where on the ramp the darkest and the median triangle are
  const ramps = {};
  for (const by of ['triangle', 'organ']) {
    state.by = by;
    for (const how of ['log', 'linear', 'quantiles']) {
      state.scaling = how;
      recolour();
      const places = Array.from(shownValues(), (value) => place(value, report.scales[state.band][by], how)).sort((a, b) => a - b);
      ramps[`${by} ${how}`] = { places: [0.1, 0.25, 0.5, 0.75, 0.9].map((part) => places[Math.floor(part * places.length)]), ticks: element('scale').innerText };
    }
  }
  const minus_zeros = document.body.innerText.match(/-0(\.0*)?(?![\d.])/g) || [];
  const wide = document.documentElement.scrollWidth > document.documentElement.clientWidth;
  const order = [...document.querySelectorAll('h2')].map((heading) => heading.textContent);
  return { ramps, minus_zeros, wide, order, facts: element('facts').textContent, pixels: canvas.width * canvas.height, drawn, colours: colours.size, gl_error: gl.getError(), picked: state.picked, panel: element('picked').innerText };
}

try {
  startView();
} catch (error) {
  state.view = null;
  for (const id of ['canvas', 'scale', 'views']) element(id).hidden = true;
  for (const hint of document.querySelectorAll('#drawing .hint')) hint.hidden = true;
  element('message').hidden = false;
  element('message').textContent = report.not_drawn || `This browser cannot draw the canopy in 3D (${error.message}). All numbers are below.`;
}
element('band').innerHTML = report.bands.map((band, k) => `<option value="${k}">${html(band)}</option>`).join('');
element('band').addEventListener('change', (event) => { state.band = Number(event.target.value); recolour(); showProfiles(); });
element('by').addEventListener('change', (event) => { state.by = event.target.value; recolour(); });
element('scaling').addEventListener('change', (event) => { state.scaling = event.target.value; recolour(); });
element('views').addEventListener('click', (event) => {
  if (!state.view || !event.target.dataset.view) return;
  state.view.camera.look(event.target.dataset.view);
  state.view.redraw();
});
element('threshold').addEventListener('input', showProfiles);
showFacts();
showBalance();
showErrors();
recolour();
showPicked();
showProfiles();
const asked = /^#selftest=(\d+)$/.exec(location.hash);
if (asked) {
  let outcome;
  try {
    outcome = selftest(Number(asked[1]));
  } catch (error) {
    outcome = { error: String(error) };
  }
  element('selftest').textContent = JSON.stringify(outcome);
}
