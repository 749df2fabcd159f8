import {ChartGroup} from './charts.js';
import {CursorPanel} from './cursor_panel.js';
import {el} from './dom.js';
import {count, fixed, metres, number, seconds} from './format.js';
import {pageHead, pathView} from './parts.js';
import {runCharts} from './run_charts.js';
import {runScene} from './run_scene.js';
import {kStatuses} from './status.js';

/// The page of one run.
export function showRun(data, page) {
  document.title = `stereo_slam: ${data.title}`;
  page.append(pageHead(data), facts(data));
  const frames = data.frames;
  if (frames.time_s.length === 0) {
    page.append(el('p', {class: 'message'}, 'The run has no frames, so there is nothing to show.'), foot(data));
    return;
  }
  const warnings = [unreadableWarning(data), trackingWarning(data)].filter((text) => text !== null);
  for (const warning of warnings) page.append(el('p', {class: 'message'}, warning));

  const scene = runScene(data);
  const left = el('div', {class: 'left'});
  const right = el('div', {class: 'right'});
  page.append(el('main', {}, left, right));
  const view = pathView(left, scene, (path, row) => setRow(row));
  const panel = new CursorPanel(left, data, (row) => setRow(row));
  const charts = new ChartGroup(right, frames.time_s, (row) => setRow(row));
  for (const chart of runCharts(data)) charts.add(chart);
  page.append(...reasonTable(data), loopTable(data, (row) => setRow(row)), foot(data));

  let shown = -1;
  function setRow(row) {
    if (row === shown) return;
    shown = row;
    panel.setRow(row);
    charts.setRow(row);
    view.setCursor(scene.paths.map((path) => (path.cursor ? row : null)));
  }
  setRow(frames.time_s.length - 1);
}

function unreadableWarning(data) {
  const images = data.unreadable_images;
  return images > 0 ? `${count(images, 'image')} could not be read, and ${images === 1 ? 'was' : 'were'} treated as missing: run.yaml names them.` : null;
}

function trackingWarning(data) {
  const {frames, status_counts: counts} = data;
  const tracked = counts[1] + counts[2] + counts[4];
  if (frames.time_s.length === 1) return 'The run has a single frame: it is the origin of the world, and there is no path.';
  if (tracked === 0) return 'No frame could be tracked: every pose is a prediction, and the path means nothing. “stereo_slam info” tells what is wrong with a recording.';
  if (counts[3] > 0) return `${counts[3]} of ${data.frame_count} frames ${counts[3] === 1 ? 'was lost: its pose is a prediction' : 'were lost: their poses are predictions'}.`;
  return null;
}

function facts(data) {
  const {status_counts: counts, truth} = data;
  const list = [
    ['State', data.state, data.error ? '' : seconds(data.seconds), data.state],
    ['Frames', data.frame_count, `${counts[3]} lost, ${counts[2]} weak`],
    ['Path length', metres(data.length_m), truth ? `error ${number(truth.ate_m, 2)} m (ATE)` : ''],
    ['Time per frame', `${fixed(data.median_ms, 1)} ms`, 'median'],
    ['Loops', data.loop_counts.accepted, `${data.loop_counts.refused} refused`],
    ['Landmarks', data.landmark_count, count(data.keyframe_count, 'keyframe')],
    ['Memory', data.peak_mb == null ? 'unknown' : `${fixed(data.peak_mb, 0)} MB`,
      data.bytes_per_keyframe > 0 ? `${fixed(data.bytes_per_keyframe / 1000, 0)} kB per keyframe` : ''],
    ['Preset', data.preset, `version ${data.version}`],
  ];
  return el('dl', {class: 'facts'}, list.map(([name, value, more, css]) =>
    el('div', {}, el('dt', {}, name), el('dd', {class: css}, String(value), more ? el('small', {}, more) : null))));
}

/// Why frames are weak or lost, with the number of frames for each reason; nothing if no reason held.
function reasonTable(data) {
  const reasons = data.reasons.filter((reason) => reason.weak + reason.lost > 0);
  if (reasons.length === 0) return [];
  const head = ['reason', 'weak frames', 'lost frames'].map((name) => el('th', {}, name));
  const rows = reasons.map((reason) => el('tr', {}, el('th', {scope: 'row'}, reason.text), [reason.weak, reason.lost].map((frames) => el('td', {}, String(frames)))));
  return [el('section', {class: 'card'}, el('h3', {}, 'Why frames are weak'),
    el('table', {}, el('thead', {}, el('tr', {}, head)), el('tbody', {}, rows)),
    el('p', {class: 'note'}, 'A frame may have several reasons. A lost frame is lost because nothing measured its pose; its reasons say what else was noticed. ' +
      'The column “reasons” of covariances.csv has those of every frame.'))];
}

function loopTable(data, setRow) {
  const section = el('section', {class: 'card'}, el('h3', {}, 'Loops'));
  if (data.loops.length === 0) {
    section.append(el('p', {class: 'empty'}, 'None.'));
    return section;
  }
  const head = ['frame', 'earlier frame', 'inliers', 'chi²', 'verdict'].map((name) => el('th', {}, name));
  const rows = data.loops.map((loop) => {
    const row = data.frames.index.findIndex((frame) => frame >= loop.frame);
    const cells = [loop.frame, loop.old_frame + (loop.in_loaded_map ? ' of the loaded map' : ''), loop.inliers, fixed(loop.chi2, 1)];
    return el('tr', {onclick: () => row >= 0 && setRow(row)}, cells.map((cell) => el('td', {}, String(cell))),
      el('td', {class: loop.accepted ? 'accepted' : 'refused'}, loop.accepted ? '✓ accepted' : '✗ refused'));
  });
  section.append(el('div', {class: 'scroll'}, el('table', {}, el('thead', {}, el('tr', {}, head)), el('tbody', {}, rows))),
    el('p', {class: 'note'}, 'A loop connects a frame to an earlier one at the same place. Chi² is its squared Mahalanobis distance from the ' +
      'prediction, with six degrees of freedom; a loop above the threshold is refused and changes nothing. A click on a row moves the cursor there.'));
  if (data.loop_counts.accepted + data.loop_counts.refused > data.loops.length)
    section.append(el('p', {class: 'note'}, `The first ${data.loops.length} are listed; loops.csv has all.`));
  return section;
}

function foot(data) {
  const thinned = data.frame_count > data.frames.time_s.length && data.frames.time_s.length > 0
    ? ` Of ${Math.ceil(data.frame_count / data.frames.time_s.length)} consecutive frames one is shown, the worst tracked.` : '';
  return el('footer', {}, `Written by stereo_slam ${data.version}.${thinned} All numbers are in the files beside this one; run.yaml contains all settings.`);
}
