import {colour, el, onThemeChange} from './dom.js';
import {extentOf, roundStep, stepText} from './scale.js';

const kMargin_px = 24;

/// The view of a browser without WebGL: the same scene as View3d from above, x to the right and z upwards.
export class TopView {
  constructor(container, scene, onPick) {
    this.container = container;
    this.scene = scene;
    this.onPick = onPick;
    this.hidden = new Set();
    this.rows = [];
    this.canvas = el('canvas', {role: 'img', 'aria-label': 'Path from above'});
    container.append(this.canvas);
    this.gridStep = roundStep(extentOf(scene.paths.flatMap((path) => path.positions)) / 8);
    this.canvas.addEventListener('pointermove', (event) => this.pick(event));
    new ResizeObserver(() => this.draw()).observe(container);
    onThemeChange(() => this.draw());
    this.draw();
  }

  gridText() {
    return stepText(this.gridStep);
  }

  look() {}

  setLayer(name, visible) {
    if (visible) this.hidden.delete(name);
    else this.hidden.add(name);
    this.draw();
  }

  setCursor(rows) {
    this.rows = rows;
    this.draw();
  }

  /// Centre and pixels per metre such that all paths fit.
  fit() {
    const x = [], z = [];
    for (const {positions, background} of this.scene.paths) {
      if (background) continue;
      for (let i = 0; i + 2 < positions.length; i += 3) {
        if (!Number.isFinite(positions[i])) continue;
        x.push(positions[i]);
        z.push(positions[i + 2]);
      }
    }
    const range = (values) => values.reduce(([low, high], v) => [Math.min(low, v), Math.max(high, v)], [Infinity, -Infinity]);
    const [left, right] = x.length ? range(x) : [0, 0];
    const [near, far] = z.length ? range(z) : [0, 0];
    const {clientWidth: width, clientHeight: height} = this.container;
    const scale = Math.min((width - 2 * kMargin_px) / Math.max(right - left, 1), (height - 2 * kMargin_px) / Math.max(far - near, 1));
    return {scale, width, height, x: (left + right) / 2, z: (near + far) / 2};
  }

  place(positions, k) {
    const {scale, width, height, x, z} = this.view;
    return [width / 2 + scale * (positions[3 * k] - x), height / 2 - scale * (positions[3 * k + 2] - z)];
  }

  draw() {
    this.view = this.fit();
    const ratio = Math.min(devicePixelRatio, 2);
    this.canvas.width = ratio * this.view.width;
    this.canvas.height = ratio * this.view.height;
    const context = this.canvas.getContext('2d');
    context.scale(ratio, ratio);
    context.fillStyle = colour('view');
    context.fillRect(0, 0, this.view.width, this.view.height);
    this.drawPoints(context);
    for (const path of this.scene.paths) if (!this.hidden.has(path.layer)) this.drawPath(context, path);
    this.drawLinks(context);
    this.scene.paths.forEach((path, i) => {
      if (this.rows[i] == null) return;
      context.fillStyle = colour(path.cursorColour ?? path.colour ?? 'ink');
      context.beginPath();
      context.arc(...this.place(path.positions, this.rows[i]), 6, 0, 2 * Math.PI);
      context.fill();
    });
  }

  drawPoints(context) {
    const {points} = this.scene;
    if (!points || this.hidden.has('points')) return;
    context.fillStyle = colour('point-dark');
    for (let k = 0; 3 * k < points.positions.length; ++k) context.fillRect(...this.place(points.positions, k), 1, 1);
  }

  drawPath(context, path) {
    const styles = path.statuses ? path.styles : [path];
    styles.forEach((style, status) => {
      context.strokeStyle = colour(style.colour);
      context.lineWidth = style.width;
      context.setLineDash(style.dashed ? [6, 5] : []);
      context.beginPath();
      for (let k = 1; 3 * k < path.positions.length; ++k) {
        if ((path.statuses && path.statuses[k] !== status) || !Number.isFinite(path.positions[3 * k] + path.positions[3 * k - 3])) continue;
        context.moveTo(...this.place(path.positions, k - 1));
        context.lineTo(...this.place(path.positions, k));
      }
      context.stroke();
    });
    context.setLineDash([]);
  }

  drawLinks(context) {
    context.lineWidth = 1.5;
    for (const link of this.scene.links ?? []) {
      if (this.hidden.has(link.accepted ? 'loops' : 'refused')) continue;
      context.strokeStyle = colour(link.accepted ? 'green' : 'pink');
      context.beginPath();
      context.moveTo(...this.place(link.from, 0));
      context.lineTo(...this.place(link.to, 0));
      context.stroke();
    }
  }

  pick(event) {
    const box = this.canvas.getBoundingClientRect();
    let best = {distance: 14 ** 2, path: -1, row: -1};
    this.scene.paths.forEach((path, p) => {
      if (!path.pickable) return;
      for (let k = 0; 3 * k < path.positions.length; ++k) {
        const [x, y] = this.place(path.positions, k);
        const distance = (x - event.clientX + box.left) ** 2 + (y - event.clientY + box.top) ** 2;
        if (distance < best.distance) best = {distance, path: p, row: k};
      }
    });
    if (best.path >= 0) this.onPick(best.path, best.row);
  }
}
