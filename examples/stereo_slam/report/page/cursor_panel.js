import {el} from './dom.js';
import {fixed, number, sigmaMetres} from './format.js';
import {kStatuses, reasonTexts} from './status.js';

/// Shows the frame at the cursor: slider, image, status and the reasons for it, pose and its standard deviations.
export class CursorPanel {
  constructor(parent, data, onRow) {
    this.data = data;
    this.frames = data.frames;
    const last = this.frames.time_s.length - 1;
    this.slider = el('input', {type: 'range', min: 0, max: last, step: 1, value: last, 'aria-label': 'Frame at the cursor',
      oninput: () => onRow(Number(this.slider.value))});
    this.play = el('button', {type: 'button', class: 'play', 'aria-label': 'Play', onclick: () => this.togglePlay(onRow)}, '▶');
    this.heading = el('h2', {});
    this.badge = el('span', {class: 'badge'});
    this.reasons = el('span', {class: 'reasons'});
    this.image = el('img', {alt: ''});
    this.caption = el('figcaption', {});
    this.picture = el('figure', {class: 'thumbnail'}, this.image, this.caption);
    this.list = el('dl', {class: 'pose'});
    parent.append(el('section', {class: 'card cursor-card'}, el('div', {class: 'slider'}, this.play, this.slider),
      el('div', {class: 'cursor-head'}, this.heading, this.badge, this.reasons),
      el('div', {class: 'cursor-body'}, data.thumbnails.length > 0 ? this.picture : null, this.list)));
  }

  setRow(row) {
    const {frames, data} = this;
    this.slider.value = row;
    this.heading.textContent = `Frame ${frames.index[row]}  ·  ${fixed(frames.time_s[row], 2)} s`;
    const status = kStatuses[frames.status[row]];
    this.badge.textContent = `${status.mark || '●'} ${status.text}`;
    this.badge.style.setProperty('--c', `var(--${status.colour})`);
    this.badge.title = status.meaning;
    this.reasons.textContent = reasonTexts(data, row).join('; ');
    this.showThumbnail(frames.index[row]);
    const vector = (values, size) => values.slice(size * row, size * row + size);
    const [x, y, z] = vector(frames.position_m, 3);
    const [right, down, forward] = vector(frames.sigma_position_m, 3).map(sigmaMetres);
    const [pitch, yaw, roll] = angles_deg(vector(frames.quaternion_xyzw, 4));
    const sigma_deg = vector(frames.sigma_rotation_deg, 3).map((value) => number(value, 2));
    const lines = [
      ['Position', `${fixed(x, 2)}  ${fixed(y, 2)}  ${fixed(z, 2)} m`, 'right, down, forward of the first camera'],
      ['its sigma', `${right}  ${down}  ${forward}`, 'along the axes of the camera'],
      ['Yaw, pitch, roll', `${fixed(yaw, 2)}°  ${fixed(pitch, 2)}°  ${fixed(roll, 2)}°`, 'to the right, up, clockwise'],
      ['its sigma', `${sigma_deg[1]}°  ${sigma_deg[0]}°  ${sigma_deg[2]}°`, 'about the axes of the camera'],
      ['Speed', `${fixed(frames.speed_mps[row], 2)} m/s`],
      ['Keyframe', `${frames.keyframe[row]}${frames.keyframe[row] === frames.index[row] ? ' (this one)' : ''}, segment ${frames.segment[row]}`],
      ['Matches', `${frames.matches[row]} of ${frames.landmarks[row]} landmarks`],
    ];
    if (data.truth && data.truth.error_m[row] != null) {
      lines.push(['Error', `${number(data.truth.error_m[row])} m, ${number(data.truth.error_deg[row])}°`]);
    }
    this.list.replaceChildren(...lines.map(([name, value, title]) => el('div', {title}, el('dt', {}, name), el('dd', {}, value))));
  }

  /// The image nearest to a frame.
  showThumbnail(frame) {
    const {thumbnails} = this.data;
    if (thumbnails.length === 0) return;
    const nearest = thumbnails.reduce((best, one) => (Math.abs(one.frame - frame) < Math.abs(best.frame - frame) ? one : best));
    if (this.thumbnail !== nearest.frame) {
      this.thumbnail = nearest.frame;
      this.image.src = `data:image/jpeg;base64,${nearest.jpeg}`;
    }
    this.image.alt = `Left image of frame ${nearest.frame}`;
    this.caption.textContent = nearest.frame === frame ? `left image` : `left image of frame ${nearest.frame}`;
  }

  /// Moves the cursor through the run in ten seconds.
  togglePlay(onRow) {
    const last = this.frames.time_s.length - 1;
    this.playing = !this.playing;
    this.play.textContent = this.playing ? '❚❚' : '▶';
    let row = Number(this.slider.value) >= last ? 0 : Number(this.slider.value);
    let before = performance.now();
    const step = (now) => {
      if (!this.playing) return;
      row = Math.min(last, row + Math.max(0, now - before) / 10000 * last);
      before = now;
      onRow(Math.round(row));
      if (row >= last) this.togglePlay(onRow);
      else requestAnimationFrame(step);
    };
    if (this.playing) requestAnimationFrame(step);
  }
}

/// Pitch (up), yaw (to the right) and roll (clockwise) of a camera, R = Ry(yaw) Rx(pitch) Rz(roll), with y down and z forward.
function angles_deg([x, y, z, w]) {
  const degrees = 180 / Math.PI;
  const down = 2 * (y * z - w * x);
  return [Math.asin(Math.max(-1, Math.min(1, -down))) * degrees, Math.atan2(2 * (x * z + w * y), 1 - 2 * (x * x + y * y)) * degrees,
    Math.atan2(2 * (x * y + w * z), 1 - 2 * (x * x + z * z)) * degrees];
}
