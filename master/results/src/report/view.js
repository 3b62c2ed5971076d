// The canopy on a canvas.

const ROW = 4096;

function compile(gl, fragment) {
  const program = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.bindAttribLocation(program, 0, 'position');
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) {
    throw new Error(gl.getProgramInfoLog(program) || 'shaders do not compile');
  }
  return program;
}

// Two triangles a cell of the soil plane, and the cell of each.
function soilTriangles(soil, z, origin) {
  const { nx, ny, first_m, cell_m } = soil;
  const vertices = new Float32Array(nx * ny * 18);
  let at = 0;
  for (let iy = 0; iy < ny; iy++) {
    for (let ix = 0; ix < nx; ix++) {
      const x = first_m[0] - origin[0] + ix * cell_m[0];
      const y = first_m[1] - origin[1] + iy * cell_m[1];
      for (const [u, v] of [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]]) {
        vertices.set([x + u * cell_m[0], y + v * cell_m[1], z - origin[2]], at);
        at += 3;
      }
    }
  }
  return vertices;
}

class View {
  // vertices: nine numbers a triangle; organs: a number a triangle
  constructor(canvas, vertices, organs, soil) {
    const gl = canvas.getContext('webgl2', { antialias: true, preserveDrawingBuffer: true });
    if (!gl) throw new Error('no WebGL 2');
    Object.assign(this, { canvas, gl, vertices, organs, soil });
    this.own = organs.length;
    this.all = this.own + soil.length / 9;
    this.rows = Math.max(1, Math.ceil(this.all / ROW));
    if (this.rows > gl.getParameter(gl.MAX_TEXTURE_SIZE)) throw new Error('too many triangles for this graphics card');
    this.picked = -1;
    this.colour = compile(gl, COLOUR);
    this.pick = compile(gl, PICK);
    const buffer = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, this.all * 36, gl.STATIC_DRAW);
    gl.bufferSubData(gl.ARRAY_BUFFER, 0, vertices);
    gl.bufferSubData(gl.ARRAY_BUFFER, vertices.byteLength, soil);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 0, 0);
    gl.enable(gl.DEPTH_TEST);
    const numbers = new Uint32Array(this.rows * ROW);
    for (let t = 0; t < this.own; t++) numbers[t] = organs[t] + 1;
    this.texture(1, gl.R32UI, gl.RED_INTEGER, gl.UNSIGNED_INT, numbers);
    this.camera = new Camera(...this.box());
    this.listen();
  }

  box() {
    const low = [Infinity, Infinity, Infinity];
    const high = [-Infinity, -Infinity, -Infinity];
    for (const list of [this.vertices, this.soil]) {
      for (let k = 0; k < list.length; k++) {
        const axis = k % 3;
        if (list[k] < low[axis]) low[axis] = list[k];
        if (list[k] > high[axis]) high[axis] = list[k];
      }
    }
    return [low, high];
  }

  texture(unit, inside, form, type, data) {
    const gl = this.gl;
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
    gl.texImage2D(gl.TEXTURE_2D, 0, inside, ROW, this.rows, 0, form, type, data);
    for (const side of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, side, gl.NEAREST);
  }

  // a value of 0 to 1 a triangle, and a cell of the soil
  show(values, soilValues) {
    const gl = this.gl;
    const data = new Float32Array(this.rows * ROW);
    data.set(values);
    for (let k = 0; k < this.all - this.own; k++) data[this.own + k] = -1 - soilValues[k >> 1];
    if (this.shown) gl.deleteTexture(this.shown);
    this.texture(0, gl.R32F, gl.RED, gl.FLOAT, data);
    this.shown = gl.getParameter(gl.TEXTURE_BINDING_2D);
    this.redraw();
  }

  redraw() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => { this.waiting = false; this.draw(); });
  }

  fit() {
    const scale = Math.min(2, window.devicePixelRatio || 1);
    const width = Math.max(1, Math.round(this.canvas.clientWidth * scale));
    const height = Math.max(1, Math.round(this.canvas.clientHeight * scale));
    if (this.canvas.width !== width || this.canvas.height !== height) {
      this.canvas.width = width;
      this.canvas.height = height;
    }
  }

  matrix() {
    return this.camera.matrix(this.canvas.width / this.canvas.height);
  }

  run(program) {
    const gl = this.gl;
    gl.viewport(0, 0, this.canvas.width, this.canvas.height);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.useProgram(program);
    const at = (name) => gl.getUniformLocation(program, name);
    gl.uniformMatrix4fv(at('matrix'), false, this.matrix());
    gl.uniform1i(at('values'), 0);
    gl.uniform1i(at('organs'), 1);
    if (program === this.colour) {
      gl.uniform3fv(at('colours'), COLOURS.flatMap(rgb));
      gl.uniform1ui(at('picked'), this.picked + 1);
      gl.uniform3fv(at('eye'), this.camera.axes().back);
    }
    gl.drawArrays(gl.TRIANGLES, 0, this.all * 3);
  }

  draw() {
    this.fit();
    this.gl.clearColor(0, 0, 0, 0);
    this.run(this.colour);
  }

  // The organ at a place of the canvas, in CSS pixels; -1 for none.
  organAt(x, y) {
    const gl = this.gl;
    this.fit();
    const [width, height] = [this.canvas.width, this.canvas.height];
    // a picture of its own, whose edges are not smoothed: a mix of two numbers is a third organ
    if (!this.aside) {
      this.aside = { frame: gl.createFramebuffer(), colour: gl.createRenderbuffer(), depth: gl.createRenderbuffer() };
    }
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.aside.frame);
    for (const [buffer, format, point] of [
      [this.aside.colour, gl.RGBA8, gl.COLOR_ATTACHMENT0],
      [this.aside.depth, gl.DEPTH_COMPONENT16, gl.DEPTH_ATTACHMENT]]) {
      gl.bindRenderbuffer(gl.RENDERBUFFER, buffer);
      gl.renderbufferStorage(gl.RENDERBUFFER, format, width, height);
      gl.framebufferRenderbuffer(gl.FRAMEBUFFER, point, gl.RENDERBUFFER, buffer);
    }
    gl.clearColor(0, 0, 0, 0);
    this.run(this.pick);
    const pixel = new Uint8Array(4);
    const px = Math.floor(x * width / this.canvas.clientWidth);
    const py = height - 1 - Math.floor(y * height / this.canvas.clientHeight);
    gl.readPixels(px, py, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    return pixel[0] + 256 * pixel[1] + 65536 * pixel[2] - 1;
  }

  listen() {
    const canvas = this.canvas;
    const down = new Map();
    let travelled = 0;
    let spread = 0;
    const apart = () => {
      const [a, b] = [...down.values()];
      return Math.hypot(a.x - b.x, a.y - b.y);
    };
    canvas.addEventListener('contextmenu', (event) => event.preventDefault());
    canvas.addEventListener('pointerdown', (event) => {
      canvas.setPointerCapture(event.pointerId);
      down.set(event.pointerId, { x: event.offsetX, y: event.offsetY });
      travelled = down.size > 1 ? Infinity : 0;
      if (down.size === 2) spread = apart();
    });
    canvas.addEventListener('pointermove', (event) => {
      const last = down.get(event.pointerId);
      if (!last) return;
      const [dx, dy] = [event.offsetX - last.x, event.offsetY - last.y];
      down.set(event.pointerId, { x: event.offsetX, y: event.offsetY });
      travelled += Math.abs(dx) + Math.abs(dy);
      if (down.size === 2) {
        const now = apart();
        if (now > 0 && spread > 0) this.camera.zoom(spread / now);
        spread = now;
        this.camera.move(dx / 2, dy / 2, canvas.clientHeight);
      } else if (event.shiftKey || event.buttons === 2) {
        this.camera.move(dx, dy, canvas.clientHeight);
      } else {
        this.camera.turn(dx, dy);
      }
      this.redraw();
    });
    const up = (event) => {
      if (event.type === 'pointerup' && down.size === 1 && travelled < 4 && this.onpick) {
        this.onpick(this.organAt(event.offsetX, event.offsetY));
      }
      down.delete(event.pointerId);
    };
    canvas.addEventListener('pointerup', up);
    canvas.addEventListener('pointercancel', up);
    canvas.addEventListener('wheel', (event) => {
      event.preventDefault();
      this.camera.zoom(Math.exp(Math.max(-100, Math.min(100, event.deltaY)) * 0.002));
      this.redraw();
    }, { passive: false });
    window.addEventListener('resize', () => this.redraw());
  }
}
