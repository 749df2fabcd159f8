import * as THREE from 'three';
import {OrbitControls} from '../vendor/three/OrbitControls.js';
import {LineMaterial} from '../vendor/three/LineMaterial.js';
import {LineSegments2} from '../vendor/three/LineSegments2.js';
import {LineSegmentsGeometry} from '../vendor/three/LineSegmentsGeometry.js';
import {colour, el, onThemeChange} from './dom.js';
import {roundStep, stepText} from './scale.js';

const kFieldOfView_deg = 40;
const kPickRadius_px = 14;
const kMostMarks = 200;
const kDirections = {
  home: new THREE.Vector3(-0.45, 0.85, 0.75),
  top: new THREE.Vector3(0, 1, 1e-4),
  side: new THREE.Vector3(-1, 0.06, 0),
};

/// A three-dimensional view of paths, map points, ellipsoids and loops. The user can turn, zoom and pan it. It is drawn only
/// when something has changed, and it reports the place on a path under the pointer. The scene is
///   paths: [{name, layer, colour, positions: [x, y, z, ...], width, dashed, statuses, pickable, order,
///     background}], a higher order on top; the view need not show all of a background
///   points: {positions, intensity}, ellipsoids: [{centre, rotation, half_axes}], ellipsoid_scale,
///   links: [{from: [x, y, z], to: [x, y, z], accepted}]
/// in the axes of the first camera: x right, y down, z forward.
export class View3d {
  constructor(container, scene, onPick) {
    this.container = container;
    this.scene = scene;
    this.onPick = onPick;
    this.layers = new Map();
    this.themed = [];  // functions that take the colours of the theme
    this.pixelSized = [];  // sprites of the same size at any distance
    this.renderer = new THREE.WebGLRenderer({antialias: true, preserveDrawingBuffer: true});
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.canvas = this.renderer.domElement;
    this.canvas.setAttribute('role', 'img');
    this.canvas.setAttribute('aria-label', 'Path and map in three dimensions');
    container.append(this.canvas);
    this.stage = new THREE.Scene();
    this.world = new THREE.Group();
    this.world.rotation.x = Math.PI;  // y of the first camera points down
    this.stage.add(this.world);
    this.camera = new THREE.PerspectiveCamera(kFieldOfView_deg, 1, 0.01, 1e6);
    this.controls = new OrbitControls(this.camera, this.canvas);
    this.controls.zoomToCursor = true;
    this.controls.addEventListener('change', () => this.requestRender());

    this.corners = this.boundary();
    const size = new THREE.Box3().setFromPoints(this.corners).getSize(new THREE.Vector3());
    this.extent = Math.max(size.x, size.y, size.z, 1);
    this.addGrid();
    this.addPoints();
    for (const path of scene.paths) this.addPath(path);
    this.addEllipsoids();
    this.addLinks();
    this.cursors = scene.paths.map((path) => this.addCursor(path));
    this.ends = el('div', {class: 'view-labels'});
    container.append(this.ends);
    this.labels = this.endLabels();

    this.canvas.addEventListener('pointermove', (event) => this.pick(event));
    this.canvas.addEventListener('click', (event) => this.pick(event));
    new ResizeObserver(() => this.resize()).observe(container);
    onThemeChange(() => this.applyTheme());
    this.applyTheme();
    this.resize();
    this.look('home');
  }

  /// Positions of the paths that the view must show, in the axes of the stage.
  boundary() {
    const corners = [];
    for (const path of this.scene.paths) {
      if (path.background) continue;
      for (let i = 0; i + 2 < path.positions.length; i += 3) {
        const [x, y, z] = path.positions.slice(i, i + 3);
        if (x != null && Number.isFinite(x + y + z)) corners.push(new THREE.Vector3(x, -y, -z));
      }
    }
    if (corners.length === 0) corners.push(new THREE.Vector3());
    return corners;
  }

  layer(name) {
    if (!this.layers.has(name)) {
      const group = new THREE.Group();
      this.layers.set(name, group);
      this.world.add(group);
    }
    return this.layers.get(name);
  }

  setLayer(name, visible) {
    this.layer(name).visible = visible;
    if (name === 'path') for (const label of this.labels) label.element.hidden = !visible;
    this.requestRender();
  }

  addGrid() {
    this.gridStep = roundStep(this.extent / 8);
    const cells = 2 * Math.ceil(this.extent / this.gridStep) + 4;
    const grid = new THREE.GridHelper(cells * this.gridStep, cells);
    const box = new THREE.Box3().setFromPoints(this.corners);
    const centre = box.getCenter(new THREE.Vector3());
    const snap = (value) => this.gridStep * Math.round(value / this.gridStep);
    grid.position.set(snap(centre.x), box.min.y - 0.002 * this.extent, snap(centre.z));
    grid.material.vertexColors = false;
    grid.renderOrder = -1;
    grid.material.depthWrite = false;
    this.themed.push(() => grid.material.color.set(colour('grid')));
    this.stage.add(grid);
  }

  gridText() {
    return stepText(this.gridStep);
  }

  addPoints() {
    const {points} = this.scene;
    if (!points || points.positions.length === 0) return;
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.Float32BufferAttribute(points.positions, 3));
    const material = new THREE.PointsMaterial({size: 2 * Math.min(devicePixelRatio, 2), sizeAttenuation: false, vertexColors: true});
    this.layer('points').add(new THREE.Points(geometry, material));
    this.themed.push(() => {
      const low = new THREE.Color(colour('point-dark'));
      const high = new THREE.Color(colour('point-light'));
      const colours = points.intensity.flatMap((value) => low.clone().lerp(high, value / 255).toArray());
      geometry.setAttribute('color', new THREE.Float32BufferAttribute(colours, 3));
    });
  }

  addSegments(group, segments, style) {
    if (segments.length === 0) return;
    const geometry = new LineSegmentsGeometry();
    geometry.setPositions(segments);
    const dash = 0.008 * this.extent;
    const material = new LineMaterial({linewidth: style.width, dashed: Boolean(style.dashed), dashSize: dash, gapSize: dash});
    material.transparent = style.opacity != null;
    material.opacity = style.opacity ?? 1;
    material.depthTest = false;  // map points do not hide lines
    const line = new LineSegments2(geometry, material);
    line.renderOrder = style.order ?? 1;
    if (style.dashed) line.computeLineDistances();
    group.add(line);
    this.themed.push(() => material.color.set(colour(style.colour)));
  }

  /// Steps of a path, those of each status with its own style; a step has the status of the frame that it ends in.
  addPath(path) {
    const group = this.layer(path.layer);
    const styles = path.statuses ? path.styles : [path];
    const segments = styles.map(() => []);
    for (let k = 1; 3 * k + 2 < path.positions.length; ++k) {
      const step = path.positions.slice(3 * k - 3, 3 * k + 3);
      if (step.every((value) => Number.isFinite(value))) segments[path.statuses ? path.statuses[k] : 0].push(...step);
    }
    styles.forEach((style, i) => this.addSegments(group, segments[i], {...style, order: path.order}));
    if (path.statuses) this.addMarks(group, path);
  }

  /// A sign where frames of a status begin that has one.
  addMarks(group, path) {
    let marks = 0;
    path.statuses.forEach((status, k) => {
      const style = path.styles[status];
      if (!style.mark || (k > 0 && path.statuses[k - 1] === status) || marks >= kMostMarks) return;
      ++marks;
      const sprite = this.sprite(style.mark, style.colour);
      sprite.renderOrder = 5;
      sprite.position.set(...path.positions.slice(3 * k, 3 * k + 3));
      group.add(sprite);
    });
  }

  /// A character in a disc, 18 pixels wide at any distance.
  sprite(character, colourName) {
    const canvas = el('canvas', {width: 64, height: 64});
    const context = canvas.getContext('2d');
    const texture = new THREE.CanvasTexture(canvas);
    texture.colorSpace = THREE.SRGBColorSpace;
    const sprite = new THREE.Sprite(new THREE.SpriteMaterial({map: texture, sizeAttenuation: false, depthTest: false}));
    this.pixelSized.push({sprite, size_px: 18});
    this.themed.push(() => {
      context.clearRect(0, 0, 64, 64);
      context.fillStyle = colour('card');
      context.strokeStyle = colour(colourName);
      context.lineWidth = 5;
      context.beginPath();
      context.arc(32, 32, 28, 0, 2 * Math.PI);
      context.fill();
      context.stroke();
      context.fillStyle = colour(colourName);
      context.font = 'bold 44px system-ui, sans-serif';
      context.textAlign = 'center';
      context.textBaseline = 'middle';
      context.fillText(character, 32, 34);
      texture.needsUpdate = true;
    });
    return sprite;
  }

  addEllipsoids() {
    const {ellipsoids, ellipsoid_scale: scale} = this.scene;
    if (!ellipsoids || ellipsoids.length === 0) return;
    const material = new THREE.MeshLambertMaterial({transparent: true, opacity: 0.32, depthWrite: false});
    const mesh = new THREE.InstancedMesh(new THREE.SphereGeometry(1, 28, 18), material, ellipsoids.length);
    const least = 1e-4 * this.extent;
    ellipsoids.forEach((ellipsoid, i) => {
      const axes = ellipsoid.half_axes.map((half) => Math.max(scale * half, least));
      mesh.setMatrixAt(i, new THREE.Matrix4().compose(new THREE.Vector3(...ellipsoid.centre),
        new THREE.Quaternion(...ellipsoid.rotation), new THREE.Vector3(...axes)));
    });
    mesh.frustumCulled = false;
    this.layer('ellipsoids').add(mesh);
    const light = new THREE.DirectionalLight(0xffffff, 2.2);
    light.position.set(-1, 3, 2);
    this.stage.add(light, new THREE.AmbientLight(0xffffff, 1.6));
    this.themed.push(() => material.color.set(colour('violet')));
  }

  addLinks() {
    for (const accepted of [true, false]) {
      const segments = (this.scene.links ?? []).filter((link) => link.accepted === accepted).flatMap((link) => [...link.from, ...link.to]);
      const style = accepted ? {colour: 'green', width: 1.6} : {colour: 'pink', width: 1.6, dashed: true};
      this.addSegments(this.layer(accepted ? 'loops' : 'refused'), segments, style);
    }
  }

  /// The camera at the cursor: a pyramid, or a ball for a path without orientations.
  addCursor(path) {
    const group = new THREE.Group();
    const material = new THREE.MeshBasicMaterial({depthTest: false, transparent: true, side: THREE.DoubleSide, opacity: 0.35});
    const edges = new THREE.LineBasicMaterial({depthTest: false});
    if (path.quaternions) {
      const [w, h, d] = [0.9, 0.5, 1.2];
      const tip = [0, 0, 0];
      const rim = [[-w, -h, d], [w, -h, d], [w, h, d], [-w, h, d]];
      const sides = rim.map((corner, i) => [tip, corner, rim[(i + 1) % 4]]);
      const faces = new THREE.BufferGeometry();
      faces.setAttribute('position', new THREE.Float32BufferAttribute(sides.flat(2), 3));
      const lines = new THREE.BufferGeometry();
      lines.setAttribute('position', new THREE.Float32BufferAttribute(sides.flatMap(([a, b, c]) => [a, b, b, c]).flat(), 3));
      group.add(new THREE.Mesh(faces, material), new THREE.LineSegments(lines, edges));
    }
    const dot = this.dot();
    group.add(dot);
    group.renderOrder = 10;
    group.visible = false;
    this.world.add(group);
    const name = path.cursorColour ?? path.colour ?? 'ink';
    this.themed.push(() => {
      for (const part of [material, edges, dot.material]) part.color.set(colour(name));
    });
    return group;
  }

  dot() {
    const canvas = el('canvas', {width: 64, height: 64});
    const context = canvas.getContext('2d');
    context.fillStyle = '#fff';
    context.beginPath();
    context.arc(32, 32, 30, 0, 2 * Math.PI);
    context.fill();
    const sprite = new THREE.Sprite(
      new THREE.SpriteMaterial({map: new THREE.CanvasTexture(canvas), sizeAttenuation: false, depthTest: false}));
    this.pixelSized.push({sprite, size_px: 11});
    return sprite;
  }

  /// Places the cursor of each path at its row; null hides it.
  setCursor(rows) {
    rows.forEach((row, i) => {
      const path = this.scene.paths[i];
      const position = row == null ? [] : path.positions.slice(3 * row, 3 * row + 3);
      const group = this.cursors[i];
      group.visible = position.length === 3 && position.every((value) => Number.isFinite(value));
      if (!group.visible) return;
      group.position.set(...position);
      if (path.quaternions) group.quaternion.set(...path.quaternions.slice(4 * row, 4 * row + 4));
    });
    this.requestRender();
  }

  endLabels() {
    const path = this.scene.paths[0];
    const last = path.positions.length / 3 - 1;
    const wanted = last < 1 ? [['start', 0]] : [['start', 0], ['end', last]];
    return wanted.map(([text, row]) => {
      const element = el('span', {class: text}, text);
      this.ends.append(element);
      const [x, y, z] = path.positions.slice(3 * row, 3 * row + 3);
      return {element, place: new THREE.Vector3(x, -y, -z)};
    }).filter((label) => Number.isFinite(label.place.lengthSq()));
  }

  /// Looks at the paths from a direction, as near as shows all of them.
  look(name) {
    const backward = kDirections[name].clone().normalize();
    const right = new THREE.Vector3().crossVectors(new THREE.Vector3(0, 1, 0), backward).normalize();
    const up = new THREE.Vector3().crossVectors(backward, right);
    const spans = [right, up, backward].map((axis) => {
      const values = this.corners.map((corner) => corner.dot(axis));
      return values.reduce(([low, high], value) => [Math.min(low, value), Math.max(high, value)], [Infinity, -Infinity]);
    });
    const middle = spans.map(([low, high]) => (low + high) / 2);
    const target = new THREE.Vector3();
    [right, up, backward].forEach((axis, i) => target.addScaledVector(axis, middle[i]));
    const tangent = Math.tan(THREE.MathUtils.degToRad(kFieldOfView_deg / 2)) * 0.86;  // leaves a margin
    const away = (corner) => {
      const from = corner.clone().sub(target);
      return from.dot(backward) + Math.max(Math.abs(from.dot(up)), Math.abs(from.dot(right)) / this.camera.aspect) / tangent;
    };
    const distance = this.corners.reduce((most, corner) => Math.max(most, away(corner)), 3);
    this.camera.position.copy(target).addScaledVector(backward, distance);
    this.camera.near = distance / 500;
    this.camera.far = 50 * (distance + this.extent);
    this.camera.updateProjectionMatrix();
    this.controls.target.copy(target);
    this.lastLook = name;
    this.controls.update();
    this.touched = false;
    this.requestRender();
  }

  resize() {
    const {clientWidth: width, clientHeight: height} = this.container;
    if (width === 0 || height === 0) return;
    this.renderer.setSize(width, height, false);
    const first = this.size == null;
    this.size = {width, height};
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    if (!first && this.lastLook && !this.touched) this.look(this.lastLook);
    this.requestRender();
  }

  applyTheme() {
    this.renderer.setClearColor(colour('view'), 1);
    for (const apply of this.themed) apply();
    this.requestRender();
  }

  requestRender() {
    if (this.pending) return;
    this.pending = true;
    requestAnimationFrame(() => {
      this.pending = false;
      this.render();
    });
  }

  render() {
    if (!this.size) return;
    this.camera.updateMatrixWorld();
    const height_per_px = 2 * Math.tan(THREE.MathUtils.degToRad(kFieldOfView_deg / 2)) / this.size.height;
    for (const {sprite, size_px} of this.pixelSized) sprite.scale.setScalar(size_px * height_per_px);
    const distance = this.camera.position.distanceTo(this.controls.target);
    for (const cursor of this.cursors) {
      for (const part of cursor.children) if (!part.isSprite) part.scale.setScalar(0.028 * distance);
    }
    this.renderer.render(this.stage, this.camera);
    for (const {element, place} of this.labels) {
      const at = place.clone().project(this.camera);
      const x = (at.x + 1) / 2 * this.size.width;
      const y = (1 - at.y) / 2 * this.size.height;
      element.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px)`;
      element.style.visibility = at.z < 1 ? 'visible' : 'hidden';
    }
  }

  /// Reports the pose nearest to the pointer, if one is near and no button turns the view.
  pick(event) {
    if (event.buttons !== 0) {
      this.touched = true;
      return;
    }
    const box = this.canvas.getBoundingClientRect();
    const pointer = [event.clientX - box.left, event.clientY - box.top];
    const matrix = new THREE.Matrix4().multiplyMatrices(this.camera.projectionMatrix, this.camera.matrixWorldInverse).multiply(this.world.matrixWorld);
    let best = {distance: kPickRadius_px ** 2, path: -1, row: -1};
    const place = new THREE.Vector3();
    this.scene.paths.forEach((path, p) => {
      if (!path.pickable || !this.layer(path.layer).visible) return;
      for (let k = 0; 3 * k + 2 < path.positions.length; ++k) {
        place.set(path.positions[3 * k], path.positions[3 * k + 1], path.positions[3 * k + 2]).applyMatrix4(matrix);
        const dx = (place.x + 1) / 2 * box.width - pointer[0];
        const dy = (1 - place.y) / 2 * box.height - pointer[1];
        const distance = dx * dx + dy * dy;
        if (place.z < 1 && distance < best.distance) best = {distance, path: p, row: k};
      }
    });
    if (best.path >= 0) this.onPick(best.path, best.row);
  }
}
