// 4 x 4 matrices, column by column, as WebGL takes them; and the camera, which looks at a point.

function multiply(a, b) {
  const out = new Float32Array(16);
  for (let column = 0; column < 4; column++) {
    for (let row = 0; row < 4; row++) {
      let sum = 0;
      for (let k = 0; k < 4; k++) sum += a[k * 4 + row] * b[column * 4 + k];
      out[column * 4 + row] = sum;
    }
  }
  return out;
}

class Camera {
  // low, high: corners of the box that is to be seen
  constructor(low, high) {
    this.centre = low.map((l, k) => (l + high[k]) / 2);
    this.radius = Math.max(1e-6, Math.hypot(...low.map((l, k) => high[k] - l)) / 2);
    this.look('home');
  }

  look(from) {
    this.target = [...this.centre];
    this.angle = from === 'top' ? -Math.PI / 2 : -0.9;
    this.tilt = { home: 0.45, front: 0, top: Math.PI / 2 }[from];
    this.distance = this.radius * 2.6;
  }

  turn(dx, dy) {
    this.angle -= dx * 0.008;
    this.tilt = Math.max(-1.5, Math.min(Math.PI / 2, this.tilt + dy * 0.008));
  }

  zoom(factor) {
    const distance = this.distance * factor;
    this.distance = Math.max(this.radius * 0.02, Math.min(this.radius * 20, distance));
  }

  axes() {
    const [ca, sa, ct, st] = [Math.cos(this.angle), Math.sin(this.angle), Math.cos(this.tilt), Math.sin(this.tilt)];
    return { right: [-sa, ca, 0], up: [-st * ca, -st * sa, ct], back: [ct * ca, ct * sa, st] };
  }

  // by pixels of a view of some height
  move(dx, dy, height) {
    const { right, up } = this.axes();
    const step = this.distance * 0.73 / height;
    for (let k = 0; k < 3; k++) this.target[k] += (-right[k] * dx + up[k] * dy) * step;
  }

  matrix(aspect) {
    const { right, up, back } = this.axes();
    const eye = this.target.map((t, k) => t + back[k] * this.distance);
    const dot = (v) => v[0] * eye[0] + v[1] * eye[1] + v[2] * eye[2];
    const look = new Float32Array([
      right[0], up[0], back[0], 0, right[1], up[1], back[1], 0, right[2], up[2], back[2], 0,
      -dot(right), -dot(up), -dot(back), 1]);
    const near = Math.max(this.distance - this.radius * 2.5, this.distance * 0.02);
    const far = this.distance + this.radius * 2.5 + Math.hypot(...this.target.map((t, k) => t - this.centre[k]));
    // a narrow window sees as much from side to side as a square one
    const f = 1 / Math.tan(0.35) * Math.min(1, aspect);
    const lens = new Float32Array([
      f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1,
      0, 0, 2 * far * near / (near - far), 0]);
    return multiply(lens, look);
  }
}

// Where a point is on a view, in pixels from its upper left corner; null behind the camera.
function project(matrix, point, width, height) {
  const at = (row) => matrix[row] * point[0] + matrix[4 + row] * point[1] + matrix[8 + row] * point[2] + matrix[12 + row];
  const w = at(3);
  return w > 0 ? [(at(0) / w + 1) / 2 * width, (1 - at(1) / w) / 2 * height] : null;
}
